"""``gradedesign run`` of gyroid sheet cells of stated density in a box, beside VTK's flying edges.

    python benchmarks/bench_generate.py [--cells 5 10] [--peer PYTHON]

The command runs as a user types it: imports, calibration of the cell, contour, cut with the box,
checks, STL, read-back and picture. Flying edges gets the same samples: the sheet on a grid of the
same spacing, contoured (``vtkFlyingEdges3D`` as it comes), written as binary STL, read back with
equal corners joined, its open edges counted and its volume taken. ``contour`` is its contouring
alone. Every run has a process of its own, one thread, and its processor time is user and system
time with imports. With ``--peer``, the interpreter of an environment that has microgen (GPL, so
never imported here, see bench_surface_microgen.py) makes and saves the same part.
What was measured: ``bench_generate.md``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SIZE, STEPS, DENSITY = 10.0, 24, 0.3
#: Level of the sheet at this density.
LEVEL = 0.467

CASE = """
[case]
name = "bench"
[part]
box = ["{edge} mm", "{edge} mm", "{edge} mm"]
[lattice]
cell = "gyroid-sheet"
size = "{size} mm"
density = {density}
[output]
formats = ["stl"]
"""

FLYING = """
import json, sys, time
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

cells, steps, path = int(sys.argv[1]), int(sys.argv[2]), sys.argv[5]
size, level = map(float, sys.argv[3:5])
vtk.vtkSMPTools.Initialize(1)
nodes, h = cells * steps + 2, size / steps
line = 2 * np.pi / size * h * (np.arange(nodes) - 0.5)
values = np.zeros((nodes,) * 3, dtype=np.float32)
y, z = np.meshgrid(line, line, indexing="ij")
for i, x in enumerate(line):
    g = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    values[i] = np.abs(g) - level
for axis in range(3):
    np.moveaxis(values, axis, 0)[[0, -1]] = 1.0
image = vtk.vtkImageData()
image.SetDimensions(nodes, nodes, nodes)
image.SetSpacing(h, h, h)
image.GetPointData().SetScalars(numpy_to_vtk(values.ravel()))
began = time.process_time()
contour = vtk.vtkFlyingEdges3D()
contour.SetInputData(image)
contour.SetValue(0, 0.0)
contour.Update()
took = time.process_time() - began
writer = vtk.vtkSTLWriter()
writer.SetFileTypeToBinary()
writer.SetFileName(path)
writer.SetInputData(contour.GetOutput())
writer.Write()
reader = vtk.vtkSTLReader()
reader.SetFileName(path)
edges = vtk.vtkFeatureEdges()
edges.SetInputConnection(reader.GetOutputPort())
edges.FeatureEdgesOff()
edges.ManifoldEdgesOff()
edges.Update()
mass = vtk.vtkMassProperties()
mass.SetInputConnection(reader.GetOutputPort())
mass.Update()
print(json.dumps({
    "triangles": reader.GetOutput().GetNumberOfCells(), "contour": took,
    "open": edges.GetOutput().GetNumberOfCells(), "share": mass.GetVolume() / (cells * size) ** 3,
}))
"""

MICROGEN = """
import json, sys
from microgen import Tpms
from microgen.shape.surface_functions import gyroid

cells, steps, path = int(sys.argv[1]), int(sys.argv[2]), sys.argv[5]
size, level = map(float, sys.argv[3:5])
part = Tpms(gyroid, offset=2 * level, cell_size=size, repeat_cell=cells, resolution=steps)
surface = part.generate_vtk("sheet")
surface.save(path)
print(json.dumps({
    "triangles": surface.n_cells, "open": surface.n_open_edges,
    "share": surface.volume / (cells * size) ** 3,
}))
"""


def measured(command: list[str]) -> tuple[str, dict[str, float]]:
    """Output of a process, and its processor time, wall time and peak memory."""
    threads = {f"{name}_NUM_THREADS": "1" for name in ("NUMBA", "OMP", "OPENBLAS")}
    kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    began = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen(command, stdout=output, text=True, env=kept | threads)
        _, status, used = os.wait4(process.pid, 0)
        if status:
            sys.exit(f"{command[:3]} ended with {os.waitstatus_to_exitcode(status)}")
        output.seek(0)
        text = output.read()
    return text, {
        "cpu": used.ru_utime + used.ru_stime,
        "wall": time.perf_counter() - began,
        "peak": used.ru_maxrss / 2**20,
    }


def show(name: str, cost: dict[str, float], found: dict[str, float]) -> None:
    """Print a line."""
    print(
        f"{name:13s} cpu {cost['cpu']:6.1f} s  wall {cost['wall']:6.1f} s  peak "
        f"{cost['peak']:5.2f} GB  {found['triangles']:.0f} triangles, density "
        f"{found['share']:.4f}",
        flush=True,
    )


def ours(cells: int, folder: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Cost and result of the command."""
    case = folder / "case.toml"
    case.write_text(CASE.format(edge=SIZE * cells, size=SIZE, density=DENSITY), encoding="utf-8")
    out = folder / "out"
    command = [sys.executable, "-m", "gradedesign", "run", str(case), "-o", str(out)]
    _, cost = measured([*command, "--overwrite"])
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    triangles = ((out / "lattice.stl").stat().st_size - 84) // 50
    return cost, {"triangles": triangles, "share": result["relative_density"]}


def main() -> None:
    """Run both on every size and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, nargs="+", default=[5, 10])
    parser.add_argument("--peer", default=".venv-microgen/bin/python")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ours(3, folder)  # compiles; smaller surfaces take other ways
        for cells in options.cells:
            print(f"{cells}^3 cells, {cells * STEPS}^3 cubes")
            numbers = [str(n) for n in (cells, STEPS, SIZE, LEVEL, folder / "peer.stl")]
            cost, found = ours(cells, folder)
            show("gradedesign", cost, found)
            text, peer = measured([sys.executable, "-c", FLYING, *numbers])
            flying = json.loads(text.splitlines()[-1])
            show("flying edges", peer, flying)
            print(
                f"gradedesign / flying edges: cpu {cost['cpu'] / peer['cpu']:.2f} to a checked "
                f"file, {cost['cpu'] / flying['contour']:.1f} of its contour alone "
                f"({flying['contour']:.2f} s), peak memory {cost['peak'] / peer['peak']:.2f}"
            )
            if Path(options.peer).is_file():
                text, peer = measured([options.peer, "-c", MICROGEN, *numbers])
                show("microgen", peer, json.loads(text.splitlines()[-1]))
                print(f"microgen / gradedesign: cpu {peer['cpu'] / cost['cpu']:.2f}")


if __name__ == "__main__":
    main()
