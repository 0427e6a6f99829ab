"""Compiled kernels: moments of the negative part of a function over tetrahedra.

Every tetrahedron is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def _add(corners: Any, share: float, moments: Any) -> None:
    """Add the moments of a tetrahedron of barycentric corners ``(4, 4)`` and a volume share."""
    p = 0
    for s in range(4):
        sum_s = corners[0, s] + corners[1, s] + corners[2, s] + corners[3, s]
        for t in range(s, 4):
            sum_t = corners[0, t] + corners[1, t] + corners[2, t] + corners[3, t]
            product = 0.0
            for i in range(4):
                product += corners[i, s] * corners[i, t]
            moments[p] += share * (sum_s * sum_t + product) / 20.0
            p += 1


@njit(cache=True, nogil=True)
def _between(start: Any, end: Any, at: float, corner: Any) -> None:
    """Fill `corner` with the point a share `at` of the way from `start` to `end`."""
    for s in range(4):
        corner[s] = start[s] + at * (end[s] - start[s])


@njit(cache=True, nogil=True)
def _add_corner(corners: Any, value: Any, share: float, piece: Any, moments: Any) -> None:
    """Add the tetrahedron between the first corner and where the values change their sign."""
    for s in range(4):
        piece[0, s] = corners[0, s]
    for i in range(1, 4):
        at = value[0] / (value[0] - value[i])
        share *= at
        _between(corners[0], corners[i], at, piece[i])
    _add(piece, share, moments)


@njit(cache=True, nogil=True)
def _add_wedge(corners: Any, value: Any, share: float, piece: Any, moments: Any) -> None:
    """Add the wedge between the first two corners, which are negative, and the other two.

    Cut into three tetrahedra; a and b are negative, c and d not.
    """
    ac, ad = value[0] / (value[0] - value[2]), value[0] / (value[0] - value[3])
    bc, bd = value[1] / (value[1] - value[2]), value[1] / (value[1] - value[3])
    for s in range(4):
        piece[0, s], piece[1, s] = corners[0, s], corners[1, s]
    _between(corners[0], corners[2], ac, piece[2])
    _between(corners[0], corners[3], ad, piece[3])
    _add(piece, share * ac * ad, moments)
    _between(corners[1], corners[3], bd, piece[0])
    _add(piece, share * ac * (1.0 - ad) * bd, moments)
    _between(corners[1], corners[2], bc, piece[3])
    _add(piece, share * (1.0 - ac) * bc * bd, moments)


@njit(cache=True, nogil=True)
def _add_negative(corners: Any, value: Any, share: float, piece: Any, moments: Any) -> None:
    """Add the part of a tetrahedron where values linear between its corners are negative."""
    # Negative corners first; of four corners an insertion sort is the shortest.
    for i in range(1, 4):
        for j in range(i, 0, -1):
            if value[j] < value[j - 1]:
                value[j], value[j - 1] = value[j - 1], value[j]
                for s in range(4):
                    corners[j, s], corners[j - 1, s] = corners[j - 1, s], corners[j, s]
    if value[0] >= 0.0:
        return
    if value[3] < 0.0:
        _add(corners, share, moments)
    elif value[1] >= 0.0:
        _add_corner(corners, value, share, piece, moments)
    elif value[2] >= 0.0:
        _add_wedge(corners, value, share, piece, moments)
    else:
        _add(corners, share, moments)
        for s in range(4):
            corners[0, s], corners[3, s] = corners[3, s], corners[0, s]
        value[0], value[3] = value[3], value[0]
        _add_corner(corners, value, -share, piece, moments)


@njit(cache=True, nogil=True)
def negative_moments(
    low: int,
    high: int,
    values: NDArray[np.float64],
    nodes: NDArray[np.float64],
    pieces: NDArray[np.int64],
    moments: NDArray[np.float64],
) -> None:
    """Means over tetrahedra of products of two barycentric coordinates where a function is < 0.

    Parameters
    ----------
    low, high : int
        Range of tetrahedra.
    values : (m, q) array
        At the nodes of every tetrahedron; linear in each piece between them.
    nodes : (q, 4) array
        Barycentric coordinates.
    pieces : (k, 4) array
        Nodes of the pieces of one volume that every tetrahedron is divided into.
    moments : (m, 10) array
        Added to.
    """
    k = pieces.shape[0]
    corners, piece, value = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros(4)
    for e in range(low, high):
        for number in range(k):
            for i in range(4):
                node = pieces[number, i]
                value[i] = values[e, node]
                for s in range(4):
                    corners[i, s] = nodes[node, s]
            _add_negative(corners, value, 1.0 / k, piece, moments[e])
