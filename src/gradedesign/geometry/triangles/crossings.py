"""Triangles of one surface that pass through each other."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, read_only
from gradedesign.geometry.triangles import _crossing_kernels as kernels
from gradedesign.geometry.triangles.closest import build_triangle_tree
from gradedesign.geometry.triangles.triangle_cells import CellGrid, triangle_cells

#: From as many triangles on they are searched by the cells of a grid. Chosen, not measured.
MANY = 200_000
#: Triangles of a printed surface that reach less than this beyond each other only touch, mm. A
#: micrometre, below the detail of any printer.
TOUCHING = 1e-3
#: Triangles that cross reach into a common cell by at least this share of the margin. Chosen, not
#: measured.
_SHARED = 0.01


def crossing_triangles(
    vertices: FloatArray, faces: IntArray, margin: float, grid: CellGrid | None = None
) -> IntArray:
    """Pairs of triangles that pass through each other, ``(k, 2)``.

    Two triangles pass through each other where a side of one meets the inside of the other.
    Contact is no crossing: neither triangles that share an edge, nor those that reach less than
    the margin beyond each other, nor triangles that overlap in one plane.

    Parameters
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
        Neighbours share vertex numbers.
    margin : float, mm
        Depth up to which triangles only touch.
    grid : CellGrid, optional
        Of a contour: most triangles then lie in one cell, so that there are few pairs.

    Returns
    -------
    (k, 2) int array
        For every triangle that passes through later ones, itself and one of them; the same for any
        number of threads.
    """
    crossed = np.full(len(faces), -1, dtype=np.int64)
    if len(faces) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    vertices, faces = read_only(vertices), read_only(np.asarray(faces, dtype=np.int32))
    reach = -_SHARED * margin
    many = len(faces) >= MANY
    cells = triangle_cells(vertices, faces, grid=grid, reach=reach) if many else None
    if cells is not None:
        kernels.find_crossed_in_cells(
            *(vertices, faces, cells.origin, cells.spacing, cells.shape, reach),
            *(cells.start, cells.users, margin, crossed),
        )
    else:
        tree = build_triangle_tree(vertices[faces])
        kernels.find_crossed(
            *(vertices, faces, tree.box, tree.right, tree.first, tree.count, tree.order),
            *(margin, crossed),
        )
    rows = np.flatnonzero(crossed >= 0)
    return np.stack([rows, crossed[rows]], axis=1)
