"""Tetrahedra of the sub-cells of an element, cut where a field that is linear in them is 0."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

#: Corners of the six tetrahedra of a cube along its diagonal from (0, 0, 0) to (1, 1, 1), as
#: x + 2 y + 4 z; the same division in every cube, so neighbours meet.
TETS = np.array(
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]],
    dtype=np.int64,
)


@njit(cache=True, nogil=True)
def corners_inside(samples: Any, k: int, j: int, i: int) -> int:
    """Number of the eight corners of a sub-cell that lie in the solid."""
    count = 0
    for c in range(8):
        if samples[k + (c >> 2), j + ((c >> 1) & 1), i + (c & 1)] < 0.0:
            count += 1
    return count


@njit(cache=True, nogil=True)
def load_tet(samples: Any, t: int, k: int, j: int, i: int, h: float, f: Any, p: Any) -> None:
    """Fill field ``(4,)`` and reference coordinates ``(4, 3)`` of the corners of a tetrahedron.

    `h` is the edge of a sub-cell.
    """
    for v in range(4):
        c = TETS[t, v]
        x, y, z = i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)
        f[v] = samples[z, y, x]
        p[v, 0], p[v, 1], p[v, 2] = x * h, y * h, z * h


@njit(cache=True, nogil=True)
def sort_corners(f: Any, inside: Any, outside: Any) -> int:
    """Fill the corners inside and outside ``(4,)``; returns the number of those inside."""
    n = 0
    m = 0
    for k in range(4):
        if f[k] < 0.0:
            inside[n] = k
            n += 1
        else:
            outside[m] = k
            m += 1
    return n


@njit(cache=True, nogil=True)
def cut_edge(f: Any, p: Any, a: int, b: int, out: Any) -> None:
    """Point ``(3,)`` of the edge from corner a to corner b at which the field is 0."""
    t = f[a] / (f[a] - f[b])
    for d in range(3):
        out[d] = p[a, d] + t * (p[b, d] - p[a, d])
