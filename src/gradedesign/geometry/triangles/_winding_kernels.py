"""Compiled winding numbers: at points, and along parallel rays."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True)
def solid_angle(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Solid angle of a triangle seen from the origin, positive from behind."""
    la = np.sqrt(ax * ax + ay * ay + az * az)
    lb = np.sqrt(bx * bx + by * by + bz * bz)
    lc = np.sqrt(cx * cx + cy * cy + cz * cz)
    triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = (
        la * lb * lc
        + (ax * bx + ay * by + az * bz) * lc
        + (bx * cx + by * cy + bz * cz) * la
        + (cx * ax + cy * ay + cz * az) * lb
    )
    return 2.0 * np.arctan2(triple, below)


@njit(cache=True, parallel=True)
def solid_angles(corners, points, result):
    """Fill the sum of the solid angles of all triangles seen from every point, over 4 pi."""
    for k in prange(len(points)):
        total = 0.0
        for f in range(len(corners)):
            ax = corners[f, 0, 0] - points[k, 0]
            ay = corners[f, 0, 1] - points[k, 1]
            az = corners[f, 0, 2] - points[k, 2]
            bx = corners[f, 1, 0] - points[k, 0]
            by = corners[f, 1, 1] - points[k, 1]
            bz = corners[f, 1, 2] - points[k, 2]
            cx = corners[f, 2, 0] - points[k, 0]
            cy = corners[f, 2, 1] - points[k, 1]
            cz = corners[f, 2, 2] - points[k, 2]
            total += solid_angle(ax, ay, az, bx, by, bz, cx, cy, cz)
        result[k] = total / (4.0 * np.pi)


@njit(cache=True)
def _side(ax, ay, bx, by, x, y):
    """Twice the area of (a, b, point), exactly opposite for (b, a, point)."""
    if ax < bx or (ax == bx and ay < by):
        return (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    return -((ax - bx) * (y - by) - (ay - by) * (x - bx))


@njit(cache=True)
def _visit(corners, origin, step, shape, start, filled, depth, turn):
    """Meet every ray along z with every triangle; with no ``depth``, only count the meetings."""
    for f in range(len(corners)):
        ax, ay = corners[f, 0, 0], corners[f, 0, 1]
        bx, by = corners[f, 1, 0], corners[f, 1, 1]
        cx, cy = corners[f, 2, 0], corners[f, 2, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        i0 = max(0, int(np.ceil((min(ax, bx, cx) - origin[0]) / step[0])))
        i1 = min(shape[0] - 1, int(np.floor((max(ax, bx, cx) - origin[0]) / step[0])))
        for i in range(i0, i1 + 1):
            x = origin[0] + i * step[0]
            low, high = np.inf, -np.inf
            for px, py, qx, qy in ((ax, ay, bx, by), (bx, by, cx, cy), (cx, cy, ax, ay)):
                if min(px, qx) <= x <= max(px, qx) and px != qx:
                    y = py + (qy - py) * ((x - px) / (qx - px))
                    low, high = min(low, y), max(high, y)
            if high < low:
                continue
            # A cell more to both sides: which rays are inside is settled by the sides alone.
            j0 = max(0, int(np.ceil((low - origin[1]) / step[1])) - 1)
            j1 = min(shape[1] - 1, int(np.floor((high - origin[1]) / step[1])) + 1)
            for j in range(j0, j1 + 1):
                y = origin[1] + j * step[1]
                u = _side(bx, by, cx, cy, x, y)
                v = _side(cx, cy, ax, ay, x, y)
                w = _side(ax, ay, bx, by, x, y)
                if not ((u > 0 and v > 0 and w > 0) or (u < 0 and v < 0 and w < 0)):
                    continue
                ray = i * shape[1] + j
                if len(depth):
                    total = u + v + w
                    place = start[ray] + filled[ray]
                    depth[place] = (
                        u * corners[f, 0, 2] + v * corners[f, 1, 2] + w * corners[f, 2, 2]
                    ) / total
                    turn[place] = 1 if u < 0 else -1  # a facet that looks down lets the ray in
                filled[ray] += 1


@njit(cache=True)
def _sort(depth, turn, a, b):
    """Sort the few meetings of a ray by depth."""
    for k in range(a + 1, b):
        d, t, m = depth[k], turn[k], k
        while m > a and depth[m - 1] > d:
            depth[m], turn[m] = depth[m - 1], turn[m - 1]
            m -= 1
        depth[m], turn[m] = d, t


@njit(cache=True)
def ray_lengths(corners, origin, step, shape):
    """Lengths along rays parallel to z by winding number, and the number of torn rays.

    Parameters
    ----------
    corners : (m, 3, 3) array, mm
    origin, step : (2,) arrays, mm
        First ray and distance of rays along x and y.
    shape : (2,) int array
        Rays along x and y.

    Returns
    -------
    solid, excess, reversed : floats, mm
        Sums over rays of the lengths with a winding number of at least 1, of its excess over 1
        and of its magnitude below 0.
    torn : int
        Rays that enter and leave the surface unequally often; not summed.
    """
    rays = shape[0] * shape[1]
    none, none_turn = np.zeros(0), np.zeros(0, dtype=np.int64)
    filled = np.zeros(rays, dtype=np.int64)
    _visit(corners, origin, step, shape, filled, filled, none, none_turn)
    start = np.zeros(rays + 1, dtype=np.int64)
    for ray in range(rays):
        start[ray + 1] = start[ray] + filled[ray]
    filled[:] = 0
    depth, turn = np.zeros(start[-1] + 1), np.zeros(start[-1] + 1, dtype=np.int64)
    _visit(corners, origin, step, shape, start, filled, depth, turn)
    solid, excess, backward, torn = 0.0, 0.0, 0.0, 0
    for ray in range(rays):
        a, b = start[ray], start[ray + 1]
        if b == a:
            continue
        if turn[a:b].sum() != 0:
            torn += 1
            continue
        _sort(depth, turn, a, b)
        winding = 0
        for k in range(a, b - 1):
            winding += turn[k]
            length = depth[k + 1] - depth[k]
            if winding > 0:
                solid += length
                excess += (winding - 1) * length
            else:
                backward -= winding * length
    return solid, excess, backward, torn
