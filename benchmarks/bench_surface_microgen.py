"""A graded gyroid sheet from field to closed surface, beside microgen at equal samples.

    python benchmarks/bench_surface_microgen.py [--samples 128] [--rounds 3] [--peer PYTHON]

Four cells along each axis; the level of the sheet runs linearly from 0.2 to 0.7 along x, and the
box closes it. Every run has a process of its own, in turn, so that its peak memory is its own.
Imports and compiling are not counted. microgen is GPL: it is asked in an environment of its own
and never imported here. PYTHON is the interpreter of that environment:

    python -m venv .venv-microgen && .venv-microgen/bin/pip install microgen==1.3.2

Wanted: at least 10 times as fast, with less memory. The ratio of processor times does not depend on
what else the machine does.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

CELLS, LOW, HIGH = 4, 0.2, 0.7

#: Code for the peer's interpreter: field, clipped grid, surface, as its documentation makes a part.
PEER = """
import json, resource, sys, time
import numpy as np
from microgen import Tpms
from microgen.shape.surface_functions import gyroid

cells, per_cell, low, high = int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[3:5])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
wall, cpu = time.perf_counter(), time.process_time()
part = Tpms(
    gyroid, offset=lambda x, y, z: 2 * (low + (high - low) * (x / cells + 0.5)),
    repeat_cell=cells, resolution=per_cell,
)
surface = part.generate_vtk("sheet")
wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps({
    "wall": wall, "cpu": cpu, "peak": peak, "imports": before, "triangles": surface.n_cells,
    "open": surface.n_open_edges, "share": surface.volume / cells**3,
}))
"""


def measure(per_cell: int) -> None:
    """Time ours in this process and print what was found."""
    from gradedesign.geometry.contour.surface import extract_surface, require_closed
    from gradedesign.program.host.registry import build_registry

    gyroid = build_registry().cell_families["gyroid-sheet"].shape

    def field(points: np.ndarray) -> np.ndarray:
        return gyroid(points.astype(np.float32)) - (LOW + (HIGH - LOW) * points[0] / CELLS)

    def surface(nodes: int):
        # Two nodes lie outside the box.
        return extract_surface(field, (0, 0, 0), (CELLS,) * 3, CELLS / (nodes - 2))

    surface(16)  # compiles
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    wall, cpu = time.perf_counter(), time.process_time()
    found = surface(CELLS * per_cell)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    figures = {
        "wall": wall, "cpu": cpu, "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "imports": before, "triangles": len(found.faces), "open": 0,
        "share": require_closed(found) / CELLS**3,
    }  # fmt: skip
    print(json.dumps(figures))


def exact_share() -> float:
    """Volume fraction of the graded sheet from evenly spread points."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    u = CELLS * np.mod(0.5 + step[:, None] * np.arange(2_000_000), 1.0)
    x, y, z = 2 * np.pi * u
    g = np.abs(np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x))
    return float(np.mean(g <= LOW + (HIGH - LOW) * u[0] / CELLS))


def ask(command: list[str]) -> dict[str, float]:
    """What a process printed on its last line."""
    run = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(run.stdout.splitlines()[-1])


def show(name: str, runs: list[dict[str, float]]) -> dict[str, float]:
    """Print the medians of several runs and return them."""
    middle = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
    print(
        f"{name:12s} wall {middle['wall']:7.2f} s  cpu {middle['cpu']:7.2f} s  peak "
        f"{middle['peak'] / 2**20:5.2f} GB ({middle['imports'] / 2**20:.2f} GB before)  "
        f"{middle['triangles']:.0f} triangles, {middle['open']:.0f} open edges, volume "
        f"{100 * (middle['share'] / exact_share() - 1):+.3f} % of the exact share",
        flush=True,
    )
    return middle


def main() -> None:
    """Run both in turn and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=128, help="along each axis")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--peer", default=".venv-microgen/bin/python")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    per_cell = options.samples // CELLS
    if options.inside:
        measure(per_cell)
        return
    own = [sys.executable, str(Path(__file__)), "--inside", "--samples", str(options.samples)]
    peer = [options.peer, "-c", PEER, *map(str, (CELLS, per_cell, LOW, HIGH))]
    there = Path(options.peer).is_file()
    ours, theirs = [], []
    for _ in range(options.rounds):
        ours.append(ask(own))
        if there:
            theirs.append(ask(peer))
    print(f"{CELLS * per_cell}^3 samples, {options.rounds} rounds, medians")
    a = show("gradedesign", ours)
    if not there:
        print(f"microgen is not compared: no interpreter at {options.peer}, see --help")
        return
    b = show("microgen", theirs)
    print(
        f"microgen / gradedesign: wall {b['wall'] / a['wall']:.1f}, cpu {b['cpu'] / a['cpu']:.1f}, "
        f"peak memory {b['peak'] / a['peak']:.1f}, above imports "
        f"{(b['peak'] - b['imports']) / (a['peak'] - a['imports']):.1f}"
    )


if __name__ == "__main__":
    main()
