"""Compiled search of the tetrahedron that holds a point, by a uniform grid of bins."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: How far below zero a barycentric coordinate may fall before a point counts as outside.
SLACK = 1e-10
#: Points that are worth a thread: 0.1 ms of work. Chosen, not measured.
POINTS = 1024


@njit(cache=True, nogil=True)
def _bins(points, tets, t, lower, size, shape, low, high):
    """Range of bins that the box of a tetrahedron touches, written to low and high."""
    for a in range(3):
        least, most = np.inf, -np.inf
        for c in range(4):
            x = points[tets[t, c], a]
            least, most = min(least, x), max(most, x)
        low[a] = min(max(int((least - lower[a]) / size - 1e-9), 0), shape[a] - 1)
        high[a] = min(max(int((most - lower[a]) / size + 1e-9), 0), shape[a] - 1)


@njit(cache=True, nogil=True)
def bin_tets(fill, points, tets, lower, size, shape, first, members):
    """Count the members of every bin into first, or fill them where first says (and move it)."""
    low, high = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for t in range(len(tets)):
        _bins(points, tets, t, lower, size, shape, low, high)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    b = (i * shape[1] + j) * shape[2] + k
                    if fill:
                        members[first[b]] = t
                    first[b] += 1


@njit(cache=True, nogil=True)
def barycentric(points, tets, t, x, y, z):
    """Four barycentric coordinates of a point in tetrahedron t."""
    a = tets[t, 0]
    x0, y0, z0 = points[a, 0], points[a, 1], points[a, 2]
    b, c, d = tets[t, 1], tets[t, 2], tets[t, 3]
    bx, by, bz = points[b, 0] - x0, points[b, 1] - y0, points[b, 2] - z0
    cx, cy, cz = points[c, 0] - x0, points[c, 1] - y0, points[c, 2] - z0
    dx, dy, dz = points[d, 0] - x0, points[d, 1] - y0, points[d, 2] - z0
    px, py, pz = x - x0, y - y0, z - z0
    ux, uy, uz = cy * dz - cz * dy, cz * dx - cx * dz, cx * dy - cy * dx
    vx, vy, vz = py * bz - pz * by, pz * bx - px * bz, px * by - py * bx
    volume = bx * ux + by * uy + bz * uz
    wb = (px * ux + py * uy + pz * uz) / volume
    wc = -(dx * vx + dy * vy + dz * vz) / volume
    wd = (cx * vx + cy * vy + cz * vz) / volume
    return 1.0 - wb - wc - wd, wb, wc, wd


@njit(cache=True, nogil=True)
def find_tets(low, high, points, tets, lower, size, shape, first, members, queries, owner):
    """Tetrahedron of a range of query points (3, n), the lowest number of several; -1 outside."""
    for q in range(low, high):
        x, y, z = queries[0, q], queries[1, q], queries[2, q]
        i = int(np.floor((x - lower[0]) / size))
        j = int(np.floor((y - lower[1]) / size))
        k = int(np.floor((z - lower[2]) / size))
        owner[q] = -1
        if i < -1 or j < -1 or k < -1 or i > shape[0] or j > shape[1] or k > shape[2]:
            continue
        i = min(max(i, 0), shape[0] - 1)
        j = min(max(j, 0), shape[1] - 1)
        k = min(max(k, 0), shape[2] - 1)
        b = (i * shape[1] + j) * shape[2] + k
        best = -SLACK
        for m in range(first[b], first[b + 1]):
            t = members[m]
            wa, wb, wc, wd = barycentric(points, tets, t, x, y, z)
            least = min(min(wa, wb), min(wc, wd))
            if least >= 0.0:
                owner[q] = t
                break
            if least > best:
                best = least
                owner[q] = t


@njit(cache=True, nogil=True)
def weigh(low, high, points, tets, owner, queries, weights):
    """Barycentric coordinates of a range of query points in their tetrahedra, (4, n)."""
    for q in range(low, high):
        w = barycentric(points, tets, owner[q], queries[0, q], queries[1, q], queries[2, q])
        for c in range(4):
            weights[c, q] = w[c]
