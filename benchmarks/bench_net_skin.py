"""A knot of struts with a net-skin, from the part's surface to a file of layers.

``python benchmarks/bench_net_skin.py [cell ...]``: the job that Aremu et al. (2017, table 2) time
on a Moebius knot of 511 x 480 x 299 voxels with cells of 30 voxels: 180.65 s for simple cubic and
224.53 s for F2BCC. Here a trefoil knot of 51.1 x 48 x 29.9 mm (his is not published), cells of
3 mm, layers of 0.1 mm, by ``gradedesign run``; time and memory are those of the whole command.
Pixels have the published 0.1 mm. Those of F2BCC, whose struts are 0.27 mm thick, hold 6 % less than
the field, the contours between them that the file holds 0.7 %.
What was measured: ``bench_net_skin.md``.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

CELLS, PUBLISHED = ("sc", "f2bcc"), {"sc": 180.65, "f2bcc": 224.53}
#: Edge of a pixel, mm.
PIXEL = 0.1
SIZE = (51.1, 48.0, 29.9)
CASE = """
[case]
name = "knot"
[part]
file = "knot.stl"
units = "mm"
[lattice]
cell = "{cell}"
size = "3 mm"
density = 0.2
skin = {{thickness = "0.4 mm", net = true}}
[print]
layer_height = "0.1 mm"
pixel_size = "{pixel} mm"
[output]
formats = ["cli-binary"]
"""


def knot(path):
    """Write a trefoil knot whose box has the published edges."""
    import trimesh

    t, turn = np.linspace(0, 2 * np.pi, 361)[:-1], np.linspace(0, 2 * np.pi, 49)[:-1]

    def axis(t):
        return np.array(
            [np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)]
        )

    centre, along = axis(t), axis(t + 1e-5) - axis(t - 1e-5)
    side = np.cross(along.T, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, along.T)
    up /= np.linalg.norm(up, axis=1)[:, None]
    points = centre.T[:, None] + 0.6 * (
        side[:, None] * np.cos(turn)[:, None] + up[:, None] * np.sin(turn)[:, None]
    )
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    points = (points - low) / (high - low) * SIZE
    n, m = points.shape[:2]
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ((a, b, c), (a, c, d))])
    mesh = trimesh.Trimesh(points.reshape(-1, 3), faces)
    mesh.fix_normals()
    mesh.export(path)


def net_pieces(folder):
    """Connected pieces of the net-skin, and the share of the largest, by pixels of its layers.

    The net-skin is what is solid down to its thickness below the surface; pixels are connected
    that share a face.
    """
    from gradedesign.design.case.read_case import load_case
    from gradedesign.design.resolve.fitting_part import fitting_part
    from gradedesign.design.resolve.lattice_files import printed_lattice
    from gradedesign.design.resolve.stated_lattice import stated_lattice
    from gradedesign.program.host.registry import build_registry
    from gradedesign_layers.dense_lattice import dense_lattice
    from gradedesign_layers.layers import _slice_at

    registry, case = build_registry(), load_case(folder)
    stated = stated_lattice(case, registry, fitting_part(case, registry)[1])
    part, design = stated.part, stated.design
    (net,) = design.domain.on_cells

    def field(points):
        whole = dense_lattice(design, 3.0 * case.print.pixel_size)
        return np.maximum(whole(points), -whole.part(points) - net.thickness)

    lattice = printed_lattice(
        case.named, case.print, part.surface, design, None, part=part.surface, file=None
    )
    layers = _slice_at(
        replace(lattice, design=None, field=field),
        case.print.layer_height,
        case.print.pixel_size,
    )
    return layers.dropped + 1, 1.0 - layers.dropped_share


def spent(used):
    """Processor time, s."""
    return used.ru_utime + used.ru_stime


def measure(cell):
    """Print what the command takes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        knot(folder / "knot.stl")
        case, out = folder / "case.toml", str(folder / "out")
        command = [sys.executable, "-m", "gradedesign", "run", name, "-o", out, "--overwrite"]
        case.write_text(CASE.format(cell=cell, pixel=PIXEL))
        # Once before: a fresh machine compiles then.
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        before = spent(resource.getrusage(resource.RUSAGE_CHILDREN))
        began = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        took = time.perf_counter() - began
        result = json.loads((folder / "out" / "result.json").read_text())
        pieces, largest = net_pieces(folder)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    apart = result["measures"]["disconnected"]
    print(
        f"{cell}: {took:.1f} s ({took / PUBLISHED[cell]:.3f} of the published time), "
        f"{spent(used) - before:.1f} s of processor time, "
        f"{used.ru_maxrss / 1e6:.2f} GB at most so far; printed as one piece without "
        f"{apart['count']} others ({apart['volume_share']:.2g} of the volume); the net-skin alone "
        f"is {pieces} piece{'' if pieces == 1 else 's'}, the largest {largest:.4%} of it",
        flush=True,
    )


if __name__ == "__main__":
    for cell in sys.argv[1:] or CELLS:
        measure(cell)
