"""Walls about the primitive surface as shells, as finite cells and by CalculiX, side by side.

    python benchmarks/bench_thesis_shells.py [--peer PYTHON] [--beam]

Ramirez Salazar (2022), Table 4.5, reports 2.12 mm for his primitive beam, by shell elements of its
middle surface; the solid of the same walls moves by 1.60 mm (`bench_thesis_beam.py`). A cell of
edge 1 mm is clamped at x = 0 and sheared by 1 N along z on its other face, with walls of 0.02 to
his 0.1422 of the cell: as shells by OpenSees' ASDShellQ4 (first-order shear deformation, as his
SHELL181), as finite cells, and for his thickness by quadratic tetrahedra in CalculiX. ``--beam``
solves half of his beam of 30 x 6 x 4 cells as shells too, which takes minutes. OpenSees is asked in
an environment of its own, without which solids alone are shown:

    python -m venv .venv-opensees && .venv-opensees/bin/pip install openseespy numpy
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))

YOUNG, POISSON = 200e3, 0.3
#: Wall over cell; the last is his.
THICKNESSES = (0.02, 0.05, 0.1, 0.1422)
#: Shells and bricks along a cell.
SHELLS, BRICKS = (16, 32), (16, 32)
#: Half of his beam, cells, with shells along a cell, and N / (E L) of his load of 5 kN.
BEAM, BEAM_SHELLS, BEAM_LOAD = (30, 3, 4), 8, 5000.0 / (YOUNG * 50.0)
THESIS = 2.12

#: Code for the peer's interpreter: a mesh of quadrilaterals, its clamp, mirror plane and load.
PEER = """
import json, sys
import numpy as np
import openseespy.opensees as ops

mesh, young, nu, thickness = np.load(sys.argv[1]), *map(float, sys.argv[2:5])
nodes, quads, load = mesh["nodes"], mesh["quads"], mesh["load"]
ops.model("basic", "-ndm", 3, "-ndf", 6)
for i, place in enumerate(nodes):
    ops.node(i, *map(float, place))
ops.section("ElasticMembranePlateSection", 1, young, nu, thickness, 0.0)
for k, quad in enumerate(quads):
    ops.element("ASDShellQ4", k + 1, *map(int, quad), 1)
for i in mesh["clamped"]:
    ops.fix(int(i), 1, 1, 1, 1, 1, 1)
for i in mesh["mirrored"]:
    ops.fix(int(i), 0, 1, 0, 1, 0, 1)
ops.timeSeries("Linear", 1)
ops.pattern("Plain", 1, 1)
for i in np.flatnonzero(load):
    ops.load(int(i), 0.0, 0.0, float(load[i]), 0.0, 0.0, 0.0)
ops.constraints("Plain")
ops.numberer("RCM")
ops.system("Mumps")
ops.algorithm("Linear")
ops.integrator("LoadControl", 1.0)
ops.analysis("Static")
assert ops.analyze(1) == 0
print(json.dumps(sum(load[i] * ops.nodeDisp(int(i), 3) for i in np.flatnonzero(load))))
"""


def middle_surface(cells, along):
    """Quadrilaterals of the primitive surface in a block of cells, ``along`` of them a cell.

    One vertex in every cube that the surface cuts, moved onto it, and one quadrilateral about every
    edge of the cubes' grid that it cuts (Gibson 1998, surface nets). Cubes are centred on the
    faces of the block: the surface is its own mirror image there.
    """
    step, count = 1.0 / along, [c * along for c in cells]
    grid = np.stack(np.meshgrid(*[(np.arange(n + 2) - 0.5) * step for n in count], indexing="ij"))
    inside = value(grid) > 0.0
    cube = np.stack(np.meshgrid(*[np.arange(n + 1) * step for n in count], indexing="ij"))
    x, y, z = (n + 1 for n in count)
    corners = [
        inside[i : x + i, j : y + j, k : z + k] for i in (0, 1) for j in (0, 1) for k in (0, 1)
    ]
    cut = np.any(corners, axis=0) & ~np.all(corners, axis=0)
    number = np.full(cut.shape, -1)
    number[cut] = np.arange(cut.sum())
    nodes = on_surface(cube[:, cut], cells)
    quads = []
    for axis in range(3):
        low = inside.take(range(inside.shape[axis] - 1), axis)
        crossed = np.argwhere(low != inside.take(range(1, inside.shape[axis]), axis)).T
        first, second = (d for d in range(3) if d != axis)
        within = [(crossed[d] > 0) & (crossed[d] <= count[d]) for d in (first, second)]
        crossed = crossed[:, within[0] & within[1]]
        around = []
        for a, b in ((1, 1), (0, 1), (0, 0), (1, 0)):
            at = crossed.copy()
            at[first] -= a
            at[second] -= b
            around.append(number[tuple(at)])
        quads.append(np.stack(around, axis=1))
    return nodes, np.concatenate(quads)


def value(points):
    """The primitive surface's function, of points in cells."""
    return np.cos(2 * np.pi * points).sum(axis=0)


def on_surface(points, cells):
    """Points moved onto the surface along its gradient; those on a face of the block stay there."""
    high = np.array(cells, dtype=float)[:, None]
    slide = ~(np.isclose(points, 0.0) | np.isclose(points, high))
    for _ in range(20):
        slope = -2 * np.pi * np.sin(2 * np.pi * points) * slide
        points = points - value(points) * slope / (slope**2).sum(axis=0)
    assert np.abs(value(points)).max() < 1e-6
    return points


def by_shells(peer, cells, along, thickness, *, mirrored=False):
    """Work of 1 N on the other face, N mm, by shells; half a block is mirrored at y = 0."""
    nodes, quads = middle_surface(cells, along)
    load = np.zeros(nodes.shape[1])
    for a, b in zip(quads.T, np.roll(quads, -1, axis=1).T, strict=True):
        on = np.isclose(nodes[0, a], cells[0]) & np.isclose(nodes[0, b], cells[0])
        length = np.linalg.norm(nodes[:, a[on]] - nodes[:, b[on]], axis=0)
        np.add.at(load, a[on], length)
        np.add.at(load, b[on], length)
    clamped = np.flatnonzero(np.isclose(nodes[0], 0.0))
    middle = np.flatnonzero(np.isclose(nodes[1], 0.0) & ~np.isclose(nodes[0], 0.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.npz"
        np.savez(
            path, nodes=nodes.T, quads=quads, load=load / load.sum(), clamped=clamped,
            mirrored=middle if mirrored else middle[:0],
        )  # fmt: skip
        command = [peer, "-c", PEER, str(path), str(YOUNG), str(POISSON), str(thickness)]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
    return float(json.loads(run.stdout.splitlines()[-1]))


def block(thickness):
    """One cell of walls as a finite-cell problem."""
    from finite_cell_solids import box_face, load_case, newtons, problem

    from gradedesign.program.host.registry import build_registry

    shape, low, high = build_registry().cell_families["primitive-wall"].shape, (0, 0, 0), (1, 1, 1)

    def field(points):
        inside = shape(points) - thickness / 2
        return np.maximum(inside, np.abs(points - 0.5).max(axis=0) - 0.5)

    regions = {s: box_face(s, low, high, 0, k) for k, s in enumerate(("x0", "x1"))}
    load = load_case("press", [("x0", "xyz")], [("x1", {"force": newtons(0, 0, 1)})])
    return problem(field, low, high, [load], regions)


def extrapolated(coarse, fine):
    """Limit of two values at spacings in a ratio of two whose error falls with order two."""
    return fine + (fine - coarse) / 3.0


def by_calculix(thickness):
    """Work by CalculiX on quadratic tetrahedra, N mm."""
    from bench_three_programs import by_calculix as solved_by_calculix

    from gradedesign.geometry.contour.surface import extract_surface

    solid = block(thickness)
    surface = extract_surface(solid.field, (0, 0, 0), (1, 1, 1), 0.02)
    return solved_by_calculix(solid, surface, 0.1, 2e-3)[1]


def main(arguments):
    """Print displacements by 1 N of shells and solids, times E L / N."""
    from finite_cell_solids import analyse

    for thickness in THICKNESSES:
        solid = block(thickness)
        work = YOUNG * extrapolated(*(analyse(solid, 1.0 / n).work["press"] for n in BRICKS))
        words = f"wall {thickness:g} of the cell: finite cells {work:.5g}"
        if arguments.peer:
            found = [by_shells(arguments.peer, (1, 1, 1), n, thickness) for n in SHELLS]
            shells = YOUNG * extrapolated(*found)
            words += f", shells {shells:.5g}, {shells / work:.3f} times"
        print(words, flush=True)
    if shutil.which("ccx"):
        found = YOUNG * by_calculix(THICKNESSES[-1])
        print(f"CalculiX, tetrahedra: {found:.5g}, {found / work:.3f} of the finite cells")
    if arguments.beam and arguments.peer:
        # Half of the beam under 1 N is the beam under 2 N.
        half = by_shells(arguments.peer, BEAM, BEAM_SHELLS, THICKNESSES[-1], mirrored=True)
        moved = BEAM_LOAD * YOUNG * half / 2.0
        print(f"his beam as shells: {moved:.3f} mm, {moved / THESIS:.3f} of his {THESIS:g} mm")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--peer", help="interpreter of an environment with openseespy")
    options.add_argument("--beam", action="store_true", help="solve half of his beam as shells too")
    main(options.parse_args())
