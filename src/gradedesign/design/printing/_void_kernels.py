"""Compiled passes over a grid of voxels: distances, and the widest way out of every void."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: More than any squared distance on a grid; the same number in single precision.
FAR = 1e10


@njit(cache=True, nogil=True)
def _pass(line, n, base, foot, start):
    """Replace values by the lower envelope of the parabolas that stand on them."""
    last = -1
    for q in range(n):
        base[q] = line[q]
        if base[q] >= FAR:
            continue
        while last >= 0:
            p = foot[last]
            cross = (base[q] + q * q - base[p] - p * p) / (2.0 * (q - p))
            if cross > start[last]:
                break
            last -= 1
        last += 1
        foot[last] = q
        if last == 0:
            start[0] = -FAR
        else:
            p = foot[last - 1]
            start[last] = (base[q] + q * q - base[p] - p * p) / (2.0 * (q - p))
    if last < 0:
        return
    at = 0
    for q in range(n):
        while at < last and start[at + 1] < q:
            at += 1
        p = foot[at]
        line[q] = (q - p) * (q - p) + base[p]


@njit(cache=True, nogil=True)
def distances_along(low, high, d):
    """Least of d plus the squared distance, along the last axis of each of a range of planes.

    P. F. Felzenszwalb, D. P. Huttenlocher, "Distance transforms of sampled functions", 2012.

    Parameters
    ----------
    low, high : int
    d : (nx, ny, nz) float32 array, overwritten
        Of any strides, so that one kernel serves all axes.
    """
    n = d.shape[2]
    base, start = np.zeros(n), np.zeros(n)
    foot, line = np.zeros(n, dtype=np.int64), np.zeros(n)
    for i in range(low, high):
        for j in range(d.shape[1]):
            for k in range(n):
                line[k] = d[i, j, k]
            _pass(line, n, base, foot, start)
            for k in range(n):
                d[i, j, k] = line[k]


@njit(cache=True, nogil=True)
def widest_ways(level, way, throat):
    """For every voxel of the voids, the least level on the best way to it from outside the grid.

    Parameters
    ----------
    level : (nx, ny, nz) uint16 array
        How wide a void is, 0 in the solid.
    way : (nx, ny, nz) uint16 array of 0
        Filled; stays 0 in the solid and where no way leads.
    throat : (nx, ny, nz) int32 array
        Filled with the flat index of the narrowest place of that way.
    """
    nx, ny, nz = level.shape
    flat, best, neck = level.ravel(), way.ravel(), throat.ravel()
    top = 65535
    head = np.full(top + 1, -1, dtype=np.int32)
    after = np.full(len(flat), -1, dtype=np.int32)
    for i in range(nx):
        for j in range(ny):
            inner = 0 < i < nx - 1 and 0 < j < ny - 1
            for k in range(0, nz, nz - 1 if inner and nz > 1 else 1):
                v = (i * ny + j) * nz + k
                if flat[v] > 0:
                    best[v], neck[v] = top, v
                    after[v] = head[top]
                    head[top] = v
    now = top
    while now > 0:
        v = head[now]
        if v < 0:
            now -= 1
            continue
        head[now] = after[v]
        k = v % nz
        j = (v // nz) % ny
        i = v // (nz * ny)
        for side in range(6):
            if side == 0 and i > 0:
                u = v - ny * nz
            elif side == 1 and i < nx - 1:
                u = v + ny * nz
            elif side == 2 and j > 0:
                u = v - nz
            elif side == 3 and j < ny - 1:
                u = v + nz
            elif side == 4 and k > 0:
                u = v - 1
            elif side == 5 and k < nz - 1:
                u = v + 1
            else:
                continue
            if flat[u] == 0 or best[u] != 0:
                continue
            if flat[u] < best[v]:
                best[u], neck[u] = flat[u], u
            else:
                best[u], neck[u] = best[v], neck[v]
            after[u] = head[best[u]]
            head[best[u]] = u
