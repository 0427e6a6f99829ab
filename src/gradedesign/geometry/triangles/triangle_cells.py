"""Triangles of one surface in the cells of a cubic grid: quicker than a tree for many alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray, read_only
from gradedesign.geometry.triangles import _cell_kernels as kernels
from gradedesign.geometry.triangles._surface_mesh_kernels import corners_of_box

#: Places of a triangle in the lists of cells, and cells a triangle, at most on average. Chosen, not
#: measured.
ENTRIES = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellGrid:
    """A cubic grid without end: a corner of cells ``(3,)`` and their edge, mm."""

    origin: FloatArray
    spacing: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TriangleCells:
    """Triangles by cell.

    Attributes
    ----------
    origin : (3,) array, mm
        Lower corner of the first cell.
    spacing : float, mm
    shape : (3,) array
        Number of cells.
    start : (cells + 1,) array
        Where the triangles of each cell begin in ``users``.
    users : (k,) int32 array
        Rising within a cell.
    """

    origin: FloatArray
    spacing: float
    shape: IntArray
    start: IntArray
    users: NDArray[np.int32]


def triangle_cells(
    vertices: FloatArray,
    faces: IntArray,
    *,
    width: float = 1.5,
    grid: CellGrid | None = None,
    reach: float = 0.0,
) -> TriangleCells | None:
    """Sort triangles into the cells of a grid.

    Parameters
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
        At least one.
    width : float
        Edge of a cell over the mean extent of a triangle.
    grid : CellGrid, optional
        Tried first.
    reach : float, mm
        A triangle is in the cells that come this near to it; below zero, in those that it enters
        by more.

    Returns
    -------
    TriangleCells or None
        None where triangles are too unequal: they would take `ENTRIES` places each, or more.
    """
    lower, upper = corners_of_box(read_only(vertices))
    spacing = width * float(kernels.sum_extents(vertices, faces).max()) / len(faces)
    grids = [] if grid is None else [grid]
    grids += [CellGrid(origin=lower, spacing=spacing * 1.5**n) for n in range(4)]
    most = ENTRIES * len(faces)
    for candidate in grids:
        h = candidate.spacing
        origin = candidate.origin + h * np.floor((lower - candidate.origin) / h)
        shape = np.floor((upper - origin) / h).astype(np.int64) + 1
        if np.prod(shape.astype(np.float64)) > most:
            continue
        arguments = (vertices, faces, origin, h, shape, reach)
        start = np.zeros(int(np.prod(shape)) + 1, dtype=np.int64)
        if kernels.count_in_cells(*arguments, most, start) > most:
            continue
        np.cumsum(start, out=start)
        users = kernels.list_in_cells(*arguments, start)
        return TriangleCells(origin=origin, spacing=h, shape=shape, start=start, users=users)
    return None
