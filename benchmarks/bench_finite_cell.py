"""Finite cells on gyroid sheets: unknowns, iterations, time and memory.

``python benchmarks/bench_finite_cell.py [n a cell] [cells ...]`` with cells as 2x2x2, of relative
density 0.3 or, as 30x6x4:0.15, of another one. Every block
runs in a process of its own, so that its peak of memory is its own; the kernels are compiled
before. Times are seconds of the processor, all threads together.

``python benchmarks/bench_finite_cell.py --offsets 50 2x2x2`` moves the lattice by as many random
offsets against the grid, which the faces of the block hold in place, and prints how iterations and
the work of the load vary.

``python benchmarks/bench_finite_cell.py --printed 12 4x4x4`` samples the signed distance of the
block's surface, on which acceptance judges, near the surface only and at all corners of sub-cells;
``--printed 1.26 lattice.stl`` that of a binary STL file, with bricks of 1.26 mm.
"""

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "verification"))

BLOCKS = ("2x2x2", "3x3x3", "4x4x4", "8x5x5")


def level(density):
    """Level t of the gyroid sheet |g| < t of a relative density, by 2 M points."""
    x, y, z = 2 * np.pi * np.random.default_rng(0).random((3, 2_000_000))
    g = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    return float(np.quantile(np.abs(g), density))


def solve(cells, count, density=0.3, offset=(0.0, 0.0, 0.0)):
    """Press a block of cells of edge 1 by finite cells of an edge of ``1 / count``."""
    from finite_cell_solids import analyse, box_face, gyroid_sheet, load_case, newtons, problem

    low, high = (0.0, 0.0, 0.0), tuple(map(float, cells))
    regions = {side: box_face(side, low, high, 0, k) for k, side in enumerate(("x0", "x1"))}
    press = load_case("press", [("x0", "xyz")], [("x1", {"force": newtons(-1, 0, 0)})])
    field = gyroid_sheet(level(density), cells, offset)
    return analyse(problem(field, low, high, [press], regions), 1.0 / count)


def one(count, cells, density):
    """Solve one block under compression and print what it took."""
    solve((1, 1, 1), 4)
    begin, wall = time.process_time(), time.perf_counter()
    result = solve(cells, count, density)
    print(
        json.dumps(
            {
                "cells": int(cells[0] * cells[1] * cells[2]),
                "elements": len(result.elements.position),
                "unknowns": result.unknowns,
                "iterations": result.solutions[0].iterations,
                "processor seconds": round(time.process_time() - begin, 1),
                "seconds": round(time.perf_counter() - wall, 1),
                "peak GB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
                "work": result.work["press"],
            }
        )
    )


def offsets(number, cells):
    """Solve one block at random offsets of the lattice; print the spread of iterations and work."""
    moves = np.random.default_rng(1).random((number, 3))
    found = [solve(cells, 8, offset=tuple(move)) for move in moves]
    iterations = [result.solutions[0].iterations for result in found]
    work = np.array([result.work["press"] for result in found])
    low, high = work.min() / work.mean(), work.max() / work.mean()
    print(f"{number} offsets, {found[0].unknowns} unknowns")
    print(f"iterations {min(iterations)} to {max(iterations)}, median {np.median(iterations):g}")
    print(f"work {low:.4f} to {high:.4f} of its mean")


def surface_of(name, size):
    """A closed surface: of a binary STL file, or of a block of cells contoured at a size."""
    from finite_cell_solids import gyroid_sheet

    from gradedesign.geometry.contour.surface import extract_surface
    from gradedesign.geometry.formats.read_stl import read_stl
    from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

    if name.endswith(".stl"):
        corners = read_stl(Path(name)).corners.reshape(-1, 3)
        vertices, faces = np.unique(corners, axis=0, return_inverse=True)
        return SurfaceMesh(vertices=vertices, faces=faces.reshape(-1, 3))
    cells, _, density = name.partition(":")
    cells = tuple(map(int, cells.split("x")))
    return extract_surface(gyroid_sheet(level(float(density or 0.3)), cells), (0,) * 3, cells, size)


def printed(spacing, name):
    """Sample the signed distance of a surface densely and near it; print time and points."""
    from gradedesign.arrays import LipschitzField
    from gradedesign.design.loop.printed_stage import BAND
    from gradedesign.geometry.triangles.printed_field import field_within, surface_search
    from gradedesign.mechanics.finite_cell.elements import SUBCELLS
    from gradedesign.mechanics.finite_cell.grid import fit_grid
    from gradedesign.mechanics.finite_cell.samples import classify

    surface = surface_of(name, 0.56 * spacing)
    field = field_within(surface_search(surface), BAND * spacing)
    grid = fit_grid(surface.vertices.min(axis=0), surface.vertices.max(axis=0), spacing)
    field(np.zeros((3, 10)))
    print(f"{len(surface.faces)} triangles, {np.prod(grid.shape)} bricks")
    found = []
    for what, constant in (("near the surface", 1.0), ("everywhere", np.inf)):
        asked = []

        def counted(points, asked=asked):
            asked.append(points[0].size)
            return field(points)

        begin, wall = time.process_time(), time.perf_counter()
        found.append(classify(LipschitzField(values=counted, constant=constant), grid, SUBCELLS))
        took = time.process_time() - begin
        print(
            f"{what:16} {sum(asked) / 1e6:7.2f} M points {took:7.1f} processor seconds "
            f"{time.perf_counter() - wall:7.1f} s {1e6 * took / sum(asked):6.2f} us a point"
        )
    print("equal" if all(map(np.array_equal, *found)) else "DIFFERENT", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--printed"]:
        spacing, *names = sys.argv[2:]
        for name in names:
            printed(float(spacing) if name.endswith(".stl") else 1.0 / float(spacing), name)
    elif sys.argv[1:2] == ["one"]:
        cells, _, density = sys.argv[3].partition(":")
        one(int(sys.argv[2]), tuple(map(int, cells.split("x"))), float(density or 0.3))
    elif sys.argv[1:2] == ["--offsets"]:
        offsets(int(sys.argv[2]), tuple(map(int, sys.argv[3].split("x"))))
    else:
        count = sys.argv[1] if len(sys.argv) > 1 else "8"
        for block in sys.argv[2:] or BLOCKS:
            subprocess.run([sys.executable, __file__, "one", count, block], check=True)
