"""Stuffing beside pytetwild: tetrahedra per second of a gyroid sheet, field evaluation apart.

Run ``python benchmarks/bench_stuffing.py [--tetwild]``. The sheet is |f| < 0.55 in 4 x 4 x 4 cells
at 20 cubes per cell; pytetwild, slow by the minute, gets one cell.
"""

from __future__ import annotations

import argparse
import itertools
import time

import numpy as np

from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import TetMesh, signed_volumes

LEVEL = 0.55


def gyroid(p):
    """Gyroid function of points in cell units."""
    x, y, z = 2 * np.pi * p
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


class Sheet:
    """Gyroid sheet in a box of cells, which counts the time spent in it."""

    def __init__(self, cells: int) -> None:
        self.cells = cells
        self.seconds = 0.0

    def __call__(self, p):
        """Field values, negative inside."""
        start = time.perf_counter()
        half = self.cells / 2
        box = np.abs(p - half).max(axis=0) - half
        value = np.maximum((np.abs(gyroid(p)) - LEVEL) / 6, box)
        self.seconds += time.perf_counter() - start
        return value


def exact_share(n: int = 200) -> float:
    """Volume fraction of the sheet from n^3 samples of one period."""
    u = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij")) + 0.5) / n
    return float((np.abs(gyroid(u)) < LEVEL).mean())


def dihedral_range(mesh: TetMesh) -> tuple[float, float]:
    """Least and largest dihedral angle, degrees."""
    corners = mesh.points[:, mesh.tets]
    normals = []
    for f in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]):
        a, b, c = (corners[:, k] for k in f)
        n = np.cross(b - a, c - a, axis=0)
        normals.append(n / np.linalg.norm(n, axis=0))
    cosines = [-(p * q).sum(axis=0) for p, q in itertools.combinations(normals, 2)]
    low, high = min(c.min() for c in cosines), max(c.max() for c in cosines)
    return float(np.degrees(np.arccos(high))), float(np.degrees(np.arccos(low)))


def run(cells: int, per_cell: int, rounds: int = 3) -> float:
    """Time the stuffing and print one line; returns tetrahedra per second without the field."""
    best, own = np.inf, 0.0
    for _ in range(rounds):
        sheet = Sheet(cells)
        start = time.perf_counter()
        mesh = stuff(sheet, (0, 0, 0), (cells * per_cell,) * 3, 1 / per_cell)
        seconds = time.perf_counter() - start
        if seconds - sheet.seconds < best:
            best, own = seconds - sheet.seconds, sheet.seconds
    count = mesh.tets.shape[1]
    volume = signed_volumes(mesh).sum() / cells**3
    low, high = dihedral_range(mesh)
    print(
        f"stuffing  {cells}^3 cells at {per_cell}: {count} tets, {best:.2f} s, field {own:.2f} s,"
        f" {count / best / 1e6:.2f} M tets/s, angles {low:.1f} to {high:.1f} degrees,"
        f" volume {100 * (volume / exact_share() - 1):+.2f} % of the exact share"
    )
    return count / best


def run_tetwild() -> float:
    """Time pytetwild on the surface of one cell; returns tetrahedra per second."""
    import pytetwild
    import pyvista

    n = 43
    grid = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij")) - 1.5) / 40
    values = Sheet(1)(grid)
    image = pyvista.ImageData(dimensions=values.shape, spacing=(1 / 40,) * 3)
    surface = image.contour([0.0], scalars=values.ravel(order="F"), method="flying_edges")
    vertices, faces = np.asarray(surface.points, dtype=float), surface.regular_faces
    start = time.perf_counter()
    _, tets = pytetwild.tetrahedralize(
        vertices, faces.astype(np.int32), edge_length_abs=0.05, vtk_ordering=True
    )
    seconds = time.perf_counter() - start
    print(f"pytetwild 1 cell: {len(tets)} tets, {seconds:.0f} s, {len(tets) / seconds:.0f} tets/s")
    return len(tets) / seconds


def main() -> None:
    """Run and print the ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tetwild", action="store_true", help="also time pytetwild (minutes)")
    options = parser.parse_args()
    stuff(Sheet(1), (0, 0, 0), (8, 8, 8), 1 / 8)  # compiles
    ours = run(4, 20)
    if options.tetwild:
        print(f"ratio {ours / run_tetwild():.0f}")


if __name__ == "__main__":
    main()
