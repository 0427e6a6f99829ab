"""The same mesh and nodal forces in CalculiX, an independent solver."""

import subprocess

import numpy as np
import pytest
from meshes import box_mesh, face, solve_one, uniform
from oracles.calculix import needs_ccx

from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.loads import pressure_force, resultant_load
from gradedesign.mechanics.fe.modes import buckling_modes, natural_modes
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress import element_stress
from gradedesign.mechanics.fe.supports import supports_on

YOUNG, POISSON = 70e3, 0.33

#: C3D10 numbers the mid-edge nodes 12, 23, 31, 14, 24, 34 (CalculiX CrunchiX manual): our order.
EDGE_PAIRS = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]


def bent_mesh():
    """A box bent and twisted a little, so that no two elements are alike."""
    mesh = box_mesh((60.0, 10.0, 8.0), (12, 3, 2))
    x, y, z = mesh.points
    return TetMesh(
        points=np.array([x, y + 0.002 * x**2, z + 0.004 * x * y]),
        tets=mesh.tets,
    )


def model_deck(space, fixed, density=None):
    """Nodes, elements, material and supports of a CalculiX job, by line."""
    lines = ["*NODE"]
    lines += [f"{i + 1},{x:.12g},{y:.12g},{z:.12g}" for i, (x, y, z) in enumerate(space.nodes.T)]
    lines.append("*ELEMENT,TYPE=C3D10,ELSET=ALL")
    for e, nodes in enumerate(space.elements.T + 1):
        lines.append(",".join(str(n) for n in [e + 1, *nodes]))
    lines += ["*MATERIAL,NAME=M", "*ELASTIC", f"{YOUNG},{POISSON}"]
    lines += ["*SOLID SECTION,ELSET=ALL,MATERIAL=M", "*BOUNDARY"]
    lines += [f"{node + 1},{c + 1},{c + 1}" for c, node in np.argwhere(fixed)]
    if density is not None:
        lines.insert(lines.index("*MATERIAL,NAME=M") + 1, f"*DENSITY\n{density}")
    return lines


def load_lines(force):
    """Nodal forces of a step, by line."""
    # CalculiX reads at most 20 characters per number, and stops on very small ones.
    return [
        "*CLOAD",
        *(
            f"{node + 1},{c + 1},{force[c, node]:.10e}"
            for c, node in np.argwhere(np.abs(force) > 1e-13 * np.abs(force).max())
        ),
    ]


def input_deck(space, force, fixed):
    """Text of a CalculiX job."""
    lines = [*model_deck(space, fixed), "*STEP", "*STATIC", *load_lines(force)]
    lines += ["*NODE PRINT,NSET=NALL", "U", "*END STEP"]
    lines.insert(1 + space.node_count, f"*NSET,NSET=NALL,GENERATE\n1,{space.node_count},1")
    return "\n".join(lines) + "\n"


def calculix_output(folder, deck):
    """Lines of the numbers that CalculiX prints, in words."""
    (folder / "job.inp").write_text(deck)
    done = subprocess.run(
        ["ccx", "job"], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:]
    return [line.split() for line in (folder / "job.dat").read_text().splitlines()]


def run_calculix(folder, deck, count):
    """Displacements (3, N) from CalculiX."""
    rows = calculix_output(folder, deck)
    table = np.array([[float(v) for v in r] for r in rows if len(r) == 4 and r[0].isdigit()])
    assert np.array_equal(table[:, 0], np.arange(1, count + 1))
    return table[:, 1:].T


@needs_ccx
def test_displacements_are_calculixs(tmp_path):
    mesh = bent_mesh()
    space = tet_space(mesh)
    for column, (i, j) in enumerate(EDGE_PAIRS):  # our order of edges is CalculiX's
        ends = space.nodes[:, space.elements[[i, j]]].mean(axis=1)
        assert np.allclose(space.nodes[:, space.elements[4 + column]], ends, atol=1e-12)
    tip = face(mesh, 0, 60.0)
    force = resultant_load(space, tip, (100.0, 200.0, -300.0), (4e3, -5e3, 6e3), (60.0, 0.0, 0.0))
    force += pressure_force(space, tip, 3.0)
    held = supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))])
    u = solve_one(space, uniform(space, YOUNG, POISSON), held, force, rtol=1e-10).displacement
    reference = run_calculix(tmp_path, input_deck(space, force, held.fixed), space.node_count)
    # CalculiX prints seven digits.
    assert np.abs(u - reference).max() <= 1e-6 * np.abs(reference).max()


@needs_ccx
def test_natural_frequencies_are_calculixs(tmp_path):
    mesh = bent_mesh()
    space, density = tet_space(mesh), 2.7e-9
    fixed = supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))]).fixed
    deck = "\n".join([*model_deck(space, fixed, density), "*STEP", "*FREQUENCY", "5", "*END STEP"])
    rows = calculix_output(tmp_path, deck + "\n")
    # Number of the mode, omega^2, omega, frequency, imaginary part.
    modes = [row for row in rows if len(row) == 5 and row[0].isdigit()][:5]
    system = prepare_elastic(space, uniform(space, YOUNG, POISSON))
    masses = density * signed_volumes(mesh)
    found = natural_modes(system, fixed, masses, 5, rtol=1e-5, name="test")
    # CalculiX takes the mass at four points; it is exact here. With four points the frequencies of
    # ARPACK on this stiffness are all its seven digits, 2e-5 above these at most.
    assert found.frequencies == pytest.approx([float(row[3]) for row in modes], rel=3e-5)


@needs_ccx
def test_load_factors_are_calculixs(tmp_path):
    """A bent and twisted bar, pressed and bent at once; stress varies within its elements."""
    mesh = bent_mesh()
    space = tet_space(mesh)
    tip = face(mesh, 0, 60.0)
    force = resultant_load(space, tip, (-1e4, 500.0, -800.0), (0.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    held = supports_on(space, [(face(mesh, 0, 0.0), (0.0, 0.0, 0.0))])
    deck = [*model_deck(space, held.fixed), "*STEP", "*BUCKLE", "5,1e-6", *load_lines(force)]
    rows = calculix_output(tmp_path, "\n".join([*deck, "*END STEP"]) + "\n")
    # Number of the mode and its factor; negative ones are of loads that act the other way.
    factors = [float(row[1]) for row in rows if len(row) == 2 and row[0].isdigit()]
    expected = sorted(factor for factor in factors if factor > 0.0)[:3]
    stiffness = uniform(space, YOUNG, POISSON)
    u = solve_one(space, stiffness, held, force, rtol=1e-10).displacement
    system = prepare_elastic(space, stiffness)
    found = buckling_modes(
        system, held.fixed, element_stress(space, stiffness, u), 3, rtol=1e-5, name="test"
    )
    assert found.values == pytest.approx(expected, rel=1e-5)
