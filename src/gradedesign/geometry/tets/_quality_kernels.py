"""Compiled loops of `quality`: dihedral angles and face-connected pieces of a tet mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray


@njit(cache=True, nogil=True)
def _outward_area(
    points: NDArray[Any], a: int, b: int, c: int, normal: NDArray[Any]
) -> float:  # pragma: no cover (compiled)
    """Write twice the area vector of triangle abc into ``normal``; return its length."""
    ux = points[0, b] - points[0, a]
    uy = points[1, b] - points[1, a]
    uz = points[2, b] - points[2, a]
    vx = points[0, c] - points[0, a]
    vy = points[1, c] - points[1, a]
    vz = points[2, c] - points[2, a]
    normal[0] = uy * vz - uz * vy
    normal[1] = uz * vx - ux * vz
    normal[2] = ux * vy - uy * vx
    return np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)


@njit(cache=True, nogil=True)
def largest_cosine(points: FloatArray, tets: IntArray) -> float:  # pragma: no cover (compiled)
    """Return the largest cosine of any dihedral angle.

    Parameters
    ----------
    points : (3, n) array
    tets : (4, m) int array
        A tetrahedron with a face of no area counts as having an angle of 0 degrees.
    """
    normals = np.zeros((4, 3))
    lengths = np.zeros(4)
    high = -1.0
    for t in range(tets.shape[1]):
        a, b, c, d = tets[0, t], tets[1, t], tets[2, t], tets[3, t]
        lengths[0] = _outward_area(points, b, c, d, normals[0])
        lengths[1] = _outward_area(points, a, d, c, normals[1])
        lengths[2] = _outward_area(points, a, b, d, normals[2])
        lengths[3] = _outward_area(points, a, c, b, normals[3])
        for i in range(3):
            for j in range(i + 1, 4):
                scale = lengths[i] * lengths[j]
                if scale > 0.0:
                    dot = (
                        normals[i, 0] * normals[j, 0]
                        + normals[i, 1] * normals[j, 1]
                        + normals[i, 2] * normals[j, 2]
                    )
                    high = max(high, min(1.0, -dot / scale))
                else:
                    high = 1.0
    return high


@njit(cache=True, nogil=True)
def _root(parent: IntArray, item: int) -> int:  # pragma: no cover (compiled)
    """Return the root of an item, halving the path to it."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@njit(cache=True, nogil=True)
def _facet(
    tets: IntArray, t: int, opposite: int
) -> tuple[int, int, int]:  # pragma: no cover (compiled)
    """Return the vertices of the facet opposite a local vertex, ascending."""
    a = tets[1 if opposite == 0 else 0, t]
    b = tets[2 if opposite <= 1 else 1, t]
    c = tets[3 if opposite <= 2 else 2, t]
    if a > b:
        a, b = b, a
    if b > c:
        b, c = c, b
    if a > b:
        a, b = b, a
    return a, b, c


@njit(cache=True, nogil=True)
def label_pieces(
    tets: IntArray, point_count: int
) -> tuple[IntArray, int, int]:  # pragma: no cover (compiled)
    """Label the tetrahedra that are connected through facets.

    Facets are put in buckets by their least vertex, where the few others that could be equal lie.

    Parameters
    ----------
    tets : (4, m) int array

    Returns
    -------
    labels : (m,) int array
        0, 1, ... in the order of the first tetrahedron of each piece.
    pieces : int
    crowded : int
        Facets met by a third, fourth, ... tetrahedron: more than 0 means that tetrahedra overlap.
    """
    count = tets.shape[1]
    starts = np.zeros(point_count + 1, dtype=np.int64)
    for t in range(count):
        for k in range(4):
            starts[_facet(tets, t, k)[0] + 1] += 1
    for v in range(point_count):
        starts[v + 1] += starts[v]
    fill = starts[:-1].copy()
    middle = np.zeros(4 * count, dtype=np.int64)
    last = np.zeros(4 * count, dtype=np.int64)
    owner = np.full(4 * count, -1, dtype=np.int64)
    meetings = np.zeros(4 * count, dtype=np.int8)
    parent = np.arange(count)
    crowded = 0
    for t in range(count):
        for k in range(4):
            a, b, c = _facet(tets, t, k)
            joined = False
            for slot in range(starts[a], fill[a]):
                if middle[slot] == b and last[slot] == c:
                    joined = True
                    if meetings[slot] == 1:
                        crowded += 1
                    meetings[slot] = 1
                    r, s = _root(parent, owner[slot]), _root(parent, t)
                    parent[max(r, s)] = min(r, s)
                    break
            if not joined:
                middle[fill[a]], last[fill[a]], owner[fill[a]] = b, c, t
                fill[a] += 1
    labels = np.full(count, -1, dtype=np.int64)
    pieces = 0
    for t in range(count):  # a root is the least of its piece, hence labelled before the rest
        root = _root(parent, t)
        if labels[root] < 0:
            labels[root] = pieces
            pieces += 1
        labels[t] = labels[root]
    return labels, pieces, crowded
