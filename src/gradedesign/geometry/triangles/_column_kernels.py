"""Compiled columns of triangles along the third axis: build, and winding number of points.

A triangle covers a point of the plane by the directed edges that pass it on its right, each with
half-open ends and computed the same way for both triangles that share it. So the coverage of a
closed surface adds up to nothing exactly at every point, also through edges and corners, and a
winding number is whole whatever the coordinates are.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

#: Points per unit of threaded work.
CHUNK = 1024
#: Share of a clearance that is free of rounding.
SURE = 1.0 - 1e-9


@njit(cache=True)
def _strip(corners, t, west, east):
    """Least and greatest second coordinate of a triangle between two first coordinates."""
    low, high = np.inf, -np.inf
    for e in range(3):
        ax, ay = corners[t, e, 0], corners[t, e, 1]
        bx, by = corners[t, (e + 1) % 3, 0], corners[t, (e + 1) % 3, 1]
        if west <= ax <= east:
            low, high = min(low, ay), max(high, ay)
        for x in (west, east):
            if min(ax, bx) < x < max(ax, bx):
                y = ay + (by - ay) * ((x - ax) / (bx - ax))
                low, high = min(low, y), max(high, y)
    return low, high


@njit(cache=True)
def fill_columns(corners, order, lower, step, shape, first, member):
    """Put every triangle into the columns that it may cover; with no ``member``, only count.

    Parameters
    ----------
    corners : (m, 3, 3) array, mm
        Columns run along the last coordinate.
    order : (m,) int array
        Triangles in the order in which columns are to hold them.
    lower : (2,) array, mm
    step : float, mm
    shape : (2,) int array
        Columns along the first two coordinates.
    first : (columns + 1,) int array
        Filled with counts, one place late; with ``member``, where each column is filled next.
    member : (k,) int array
    """
    pad = 1e-6 * step
    for n in range(len(order)):
        t = order[n]
        least = min(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0])
        most = max(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0])
        i0 = max(0, int(np.floor((least - pad - lower[0]) / step)))
        i1 = min(shape[0] - 1, int(np.floor((most + pad - lower[0]) / step)))
        for i in range(i0, i1 + 1):
            west = lower[0] + i * step - pad
            low, high = _strip(corners, t, west, west + step + 2 * pad)
            if high < low:
                continue
            j0 = max(0, int(np.floor((low - pad - lower[1]) / step)))
            j1 = min(shape[1] - 1, int(np.floor((high + pad - lower[1]) / step)))
            for j in range(j0, j1 + 1):
                column = i * shape[1] + j
                if len(member):
                    member[first[column]] = t
                    first[column] += 1
                else:
                    first[column + 1] += 1


@njit(cache=True)
def _coverage(corners, t, x, y):
    """1 or -1 where a triangle that looks up or down covers a place of the plane, else 0."""
    covered = 0
    for e in range(3):
        ax, ay = corners[t, e, 0], corners[t, e, 1]
        bx, by = corners[t, (e + 1) % 3, 0], corners[t, (e + 1) % 3, 1]
        if ay <= y < by:
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                covered += 1
        elif by <= y < ay and (ax - bx) * (y - by) - (ay - by) * (x - bx) > 0.0:
            covered -= 1
    return covered


@njit(cache=True)
def _height(corners, t, x, y):
    """Height of a triangle over a place that it covers, never beyond its corners."""
    ax, ay, az = corners[t, 0]
    ux, uy, uz = corners[t, 1, 0] - ax, corners[t, 1, 1] - ay, corners[t, 1, 2] - az
    vx, vy, vz = corners[t, 2, 0] - ax, corners[t, 2, 1] - ay, corners[t, 2, 2] - az
    area = ux * vy - uy * vx
    low, high = min(az, az + uz, az + vz), max(az, az + uz, az + vz)
    if area == 0.0:
        return 0.5 * (low + high)
    x, y = x - ax, y - ay
    return min(max(az + ((x * vy - y * vx) * uz + (ux * y - uy * x) * vz) / area, low), high)


@njit(cache=True)
def winding_at(corners, tops, lower, step, shape, first, member, x, y, z):
    """Winding number of a closed surface about a point, from the triangles above it."""
    i, j = int(np.floor((x - lower[0]) / step)), int(np.floor((y - lower[1]) / step))
    if not (0 <= i < shape[0] and 0 <= j < shape[1]):
        return 0
    winding = 0
    column = i * shape[1] + j
    for n in range(first[column], first[column + 1]):
        t = member[n]
        if tops[t] <= z:
            break
        covered = _coverage(corners, t, x, y)
        if covered != 0 and _height(corners, t, x, y) > z:
            winding += covered
    return winding


@njit(cache=True, parallel=True, nogil=True)
def windings(corners, tops, lower, step, shape, first, member, points, axes, clearance, result):
    """Fill the winding number of every point of a (3, n) array.

    ``axes`` are the coordinates of points that the columns' three stand for. The surface is not
    nearer to a point than its ``clearance`` (n,): a point that lies within that of the one before,
    or the one before within that of it, has the same winding number.
    """
    n = points.shape[1]
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        begin = chunk * CHUNK
        for p in range(begin, min(n, begin + CHUNK)):
            x, y, z = points[axes[0], p], points[axes[1], p], points[axes[2], p]
            if p > begin:
                free = SURE * max(clearance[p - 1], clearance[p])
                dx = points[0, p] - points[0, p - 1]
                dy = points[1, p] - points[1, p - 1]
                dz = points[2, p] - points[2, p - 1]
                if dx * dx + dy * dy + dz * dz < free * free:
                    result[p] = result[p - 1]
                    continue
            result[p] = winding_at(corners, tops, lower, step, shape, first, member, x, y, z)
