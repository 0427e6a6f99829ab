"""Compiled numbering of the edges of a tetrahedral mesh."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: Local edges in scikit-fem's order.
LOCAL_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


@njit(cache=True, nogil=True)
def number_edges(
    tets: NDArray[np.int32], n_points: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Number the edges by their lower, then by their higher vertex.

    Edges are bucketed by their lower vertex, so the work is linear in the number of tets.

    Parameters
    ----------
    tets : (4, m) int32 array

    Returns
    -------
    edge_of : (6, m) int32 array
        Edge number of every local edge.
    ends : (2, n_edges) int32 array
        Lower and higher vertex of every edge.
    """
    m = tets.shape[1]
    start = np.zeros(n_points + 1, np.int64)
    for i, j in LOCAL_EDGES:
        for e in range(m):
            start[min(tets[i, e], tets[j, e]) + 1] += 1
    for v in range(n_points):
        start[v + 1] += start[v]
    fill = start[:-1].copy()
    far = np.zeros(6 * m, np.int32)
    slot = np.zeros(6 * m, np.int64)
    for k in range(6):
        i, j = LOCAL_EDGES[k]
        for e in range(m):
            low = min(tets[i, e], tets[j, e])
            far[fill[low]] = max(tets[i, e], tets[j, e])
            slot[fill[low]] = k * m + e
            fill[low] += 1

    edge_of = np.zeros(6 * m, np.int32)
    low_end = np.zeros(6 * m, np.int32)
    high_end = np.zeros(6 * m, np.int32)
    last_seen = np.full(n_points, -1, np.int32)
    number = np.zeros(n_points, np.int32)
    count = 0
    for v in range(n_points):
        first = count
        for p in range(start[v], start[v + 1]):
            if last_seen[far[p]] != v:
                last_seen[far[p]] = v
                low_end[count] = v
                high_end[count] = far[p]
                count += 1
        high_end[first:count].sort()
        for c in range(first, count):
            number[high_end[c]] = c
        for p in range(start[v], start[v + 1]):
            edge_of[slot[p]] = number[far[p]]
    ends = np.zeros((2, count), np.int32)
    for e in range(count):
        ends[0, e], ends[1, e] = low_end[e], high_end[e]
    return edge_of.reshape(6, m), ends
