"""Volume and centroid of the solid in the parts of an element that a surface cuts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.mechanics.finite_cell._cut_tet_kernels import (
    corners_inside,
    cut_edge,
    load_tet,
    sort_corners,
)


@njit(cache=True, nogil=True)
def _tet_solid(f: Any, p: Any, index: Any, q: Any, sums: Any) -> None:
    """Add volume and first moments of the solid part of one tetrahedron to ``sums (4,)``.

    Volumes count six times; `index` ``(2, 4)`` and `q` ``(6, 3)`` are scratch.
    """
    inside, outside = index[0], index[1]
    n, first = sort_corners(f, inside, outside), np.int64(0)
    if n == 0:
        return
    if n == 4:
        _add_simplex(p, first, sums, 1.0)
    elif n == 1 or n == 3:
        # The corner alone on its side; the solid is that corner's piece, or all but it.
        lone = inside[0] if n == 1 else outside[0]
        row = 0
        for d in range(3):
            q[0, d] = p[lone, d]
        for k in range(4):
            if k != lone:
                row += 1
                cut_edge(f, p, lone, k, q[row])
        if n == 3:
            _add_simplex(p, first, sums, 1.0)
        _add_simplex(q, first, sums, 1.0 if n == 1 else -1.0)
    else:
        # A wedge between the edge of the two inner corners and the cut quadrilateral.
        for a in range(2):
            for d in range(3):
                q[3 * a, d] = p[inside[a], d]
            for b in range(2):
                cut_edge(f, p, inside[a], outside[b], q[3 * a + 1 + b])
        for k in range(3):
            _add_simplex(q, k, sums, 1.0)


@njit(cache=True, nogil=True)
def _add_simplex(p: Any, i: int, sums: Any, sign: float) -> None:
    """Add the volume and first moments of the tetrahedron of four points, i the first."""
    j, k, m = i + 1, i + 2, i + 3
    ax, ay, az = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1], p[j, 2] - p[i, 2]
    bx, by, bz = p[k, 0] - p[i, 0], p[k, 1] - p[i, 1], p[k, 2] - p[i, 2]
    cx, cy, cz = p[m, 0] - p[i, 0], p[m, 1] - p[i, 1], p[m, 2] - p[i, 2]
    volume = sign * abs(
        ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    )
    sums[0] += volume
    for d in range(3):
        sums[1 + d] += volume * 0.25 * (p[i, d] + p[j, d] + p[k, d] + p[m, d])


@njit(cache=True, nogil=True)
def solid_fractions(
    low: int, high: int, samples: Any, blocks: int, share: Any, centre: Any
) -> None:
    """Volume and centroid of the solid in each of ``blocks**3`` parts of every element.

    Parameters
    ----------
    low, high : int
        Range of elements.
    samples : (n, s+1, s+1, s+1) array
        Field at the corners of the sub-cells, [element, z, y, x]; `blocks` divides s.
    share : (n, blocks^3) array
        Written: volume over that of the element.
    centre : (n, blocks^3, 3) array
        Written: reference coordinates of the centroid; the middle of the block where nothing is.
    """
    s = samples.shape[1] - 1
    h = 1.0 / s
    step = s // blocks
    f = np.zeros(4)
    p = np.zeros((4, 3))
    index = np.zeros((2, 4), np.int64)
    q = np.zeros((6, 3))
    sums = np.zeros((blocks**3, 4))
    for e in range(low, high):
        for row in range(blocks**3):
            for d in range(4):
                sums[row, d] = 0.0
        element = samples[e]
        for k in range(s):
            for j in range(s):
                for i in range(s):
                    own = sums[((k // step) * blocks + j // step) * blocks + i // step]
                    inside = corners_inside(element, k, j, i)
                    if inside == 0:
                        continue
                    if inside == 8:
                        volume = 6.0 * h**3
                        own[0] += volume
                        own[1] += volume * (i + 0.5) * h
                        own[2] += volume * (j + 0.5) * h
                        own[3] += volume * (k + 0.5) * h
                        continue
                    for t in range(6):
                        load_tet(element, t, k, j, i, h, f, p)
                        _tet_solid(f, p, index, q, own)
        row = 0
        for k in range(blocks):
            for j in range(blocks):
                for i in range(blocks):
                    own = sums[row]
                    share[e, row] = own[0] / 6.0
                    centre[e, row, 0] = (i + 0.5) / blocks
                    centre[e, row, 1] = (j + 0.5) / blocks
                    centre[e, row, 2] = (k + 0.5) / blocks
                    if own[0] > 1e-14:
                        for d in range(3):
                            centre[e, row, d] = own[1 + d] / own[0]
                    row += 1
