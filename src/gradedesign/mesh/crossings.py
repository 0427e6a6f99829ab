"""Triangles of one surface that pass through each other."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mesh import _crossing_kernels as kernels
from gradedesign.mesh.closest import build_triangle_tree

#: From as many triangles on they are searched by the cells of a grid, in which each has this many
#: places at most on average, and whose sizes are looked at so many at a time.
MANY, _ENTRIES, _BATCH = 200_000, 10, 1 << 18


def crossing_triangles(vertices: FloatArray, faces: IntArray, margin: float) -> IntArray:
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

    Returns
    -------
    (k, 2) int array
        For every triangle that passes through later ones, itself and one of them; the same for any
        number of threads.
    """
    crossed = np.full(len(faces), -1, dtype=np.int64)
    if len(faces) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    vertices, faces = np.ascontiguousarray(vertices), np.ascontiguousarray(faces)
    if len(faces) < MANY or not _cross_in_cells(vertices, faces, margin, crossed):
        tree = build_triangle_tree(vertices[faces])
        kernels.find_crossed(
            *(vertices, faces, tree.box, tree.right, tree.first, tree.count, tree.order),
            *(margin, crossed),
        )
    rows = np.flatnonzero(crossed >= 0)
    return np.stack([rows, crossed[rows]], axis=1)


def _cross_in_cells(
    vertices: FloatArray, faces: IntArray, margin: float, crossed: IntArray
) -> bool:
    """Search by the cells of a grid; False where triangles are too unequal for one.

    Quicker than a tree, and with less memory, for triangles of about one size.
    """
    size = np.zeros(3)
    for low in range(0, len(faces), _BATCH):
        size += np.ptp(vertices[faces[low : low + _BATCH]], axis=1).sum(axis=0)
    spacing = 1.5 * float(size.max()) / len(faces)
    origin = vertices.min(axis=0)
    for _ in range(4):
        shape = np.floor((vertices.max(axis=0) - origin) / spacing).astype(np.int64) + 1
        room = kernels.count_in_cells(
            vertices, faces, origin, spacing, shape, np.zeros(0, np.int64)
        )
        if room <= _ENTRIES * len(faces) and np.prod(shape) <= _ENTRIES * len(faces):
            break
        spacing *= 1.5
    else:
        return False
    start = np.zeros(int(np.prod(shape)) + 1, dtype=np.int64)
    kernels.count_in_cells(vertices, faces, origin, spacing, shape, start)
    start = np.cumsum(start)
    users = kernels.list_in_cells(vertices, faces, origin, spacing, shape, start)
    kernels.find_crossed_in_cells(
        vertices, faces, origin, spacing, shape, start, users, margin, crossed
    )
    return True
