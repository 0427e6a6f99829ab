"""Compiled loops of `quality`: face-connected pieces of a tet mesh."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import IntArray


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
