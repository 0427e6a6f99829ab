"""Triangles of one surface that pass through each other."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, read_only
from gradedesign.common.system.threads import in_ranges
from gradedesign.geometry.triangles import _crossing_kernels as kernels
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree

#: Leaves of the tree that are worth a thread. Chosen, not measured.
_AT_ONCE = 256
#: Triangles of a printed surface that reach less than this beyond each other only touch, mm. A
#: micrometre, below the detail of any printer.
TOUCHING = 1e-3


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
    vertices, faces = read_only(vertices), read_only(np.asarray(faces, dtype=np.int32))
    tree = build_triangle_tree(vertices[faces])
    leaves = np.flatnonzero(tree.right < 0)
    in_ranges(
        *(kernels.find_crossed, range(0, len(leaves), _AT_ONCE), vertices, faces),
        *(tree.triangles, tree.box, tree.right, tree.first, tree.count, tree.order),
        *(leaves, margin, crossed),
    )
    rows = np.flatnonzero(crossed >= 0)
    return np.stack([rows, crossed[rows]], axis=1)
