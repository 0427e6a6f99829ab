"""Compiled distance to triangles of period 1, and crossings of columns with triangles."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Deeper than any tree of 2^31 leaves.
DEPTH = 64


@njit(cache=True)
def square_to_triangle(t, x, y, z):
    """Squared distance of a point to triangle t of corners (9,) (Ericson 2005, section 5.1.5)."""
    bx, by, bz = t[3] - t[0], t[4] - t[1], t[5] - t[2]
    cx, cy, cz = t[6] - t[0], t[7] - t[1], t[8] - t[2]
    px, py, pz = x - t[0], y - t[1], z - t[2]
    bb, bc, cc = (
        bx * bx + by * by + bz * bz,
        bx * cx + by * cy + bz * cz,
        cx * cx + cy * cy + cz * cz,
    )
    d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    ex, ey, ez = px - v * bx - w * cx, py - v * by - w * cy, pz - v * bz - w * cz
    return ex * ex + ey * ey + ez * ez


@njit(cache=True)
def square_to_box(lower, upper, node, x, y, z):
    """Squared distance of a point to the box of a node; infinite for an empty one."""
    dx = max(lower[node, 0] - x, 0.0, x - upper[node, 0])
    dy = max(lower[node, 1] - y, 0.0, y - upper[node, 1])
    dz = max(lower[node, 2] - z, 0.0, z - upper[node, 2])
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, nogil=True)
def nearest_distance(low, high, points, shifts, triangles, lower, upper, distance):
    """Distance of a range of points (3, n) to the nearest of the shifted triangles (m, 9).

    Node k of the tree has the children 2 k and 2 k + 1; leaf i holds triangle i.
    """
    leaves = len(lower) // 2
    stack = np.zeros(DEPTH, dtype=np.int64)
    for i in range(low, high):
        best = np.inf
        for s in range(len(shifts)):
            x = points[0, i] + shifts[s, 0]
            y = points[1, i] + shifts[s, 1]
            z = points[2, i] + shifts[s, 2]
            stack[0], depth = 1, 1
            while depth > 0:
                depth -= 1
                node = stack[depth]
                if square_to_box(lower, upper, node, x, y, z) >= best:
                    continue
                if node >= leaves:
                    best = min(best, square_to_triangle(triangles[node - leaves], x, y, z))
                    continue
                left = square_to_box(lower, upper, 2 * node, x, y, z)
                right = square_to_box(lower, upper, 2 * node + 1, x, y, z)
                near = 0 if left <= right else 1
                stack[depth] = 2 * node + 1 - near
                stack[depth + 1] = 2 * node + near
                depth += 2
        distance[i] = np.sqrt(best)


@njit(cache=True)
def side(ax, ay, bx, by, px, py):
    """On which side of the line a b a point lies, 1 left, -1 right; never on it.

    The point counts as moved by (e, e^2) with a tiny e, and each edge is taken from its lesser end,
    so that two triangles that share an edge always agree (simulation of simplicity).
    """
    turn = 1
    if bx < ax or (bx == ax and by < ay):
        ax, ay, bx, by = bx, by, ax, ay
        turn = -1
    value = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    if value == 0.0:
        value = -(by - ay) if by != ay else bx - ax
    return turn if value > 0.0 else -turn


@njit(cache=True)
def add_crossings(corners, xs, ys, zs, change):
    """Add the change of the winding number at each crossing of columns along z.

    ``corners`` (m, 3, 3), sorted coordinates; ``change`` (len(xs), len(ys), len(zs) + 1): at the
    first of zs that is not below the crossing, plus 1 where a column enters and -1 where it leaves.
    """
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        first = np.searchsorted(xs, min(ax, bx, cx))
        last = np.searchsorted(xs, max(ax, bx, cx), side="right")
        low = np.searchsorted(ys, min(ay, by, cy))
        high = np.searchsorted(ys, max(ay, by, cy), side="right")
        for i in range(first, last):
            for j in range(low, high):
                x, y = xs[i], ys[j]
                s = side(ax, ay, bx, by, x, y)
                if side(bx, by, cx, cy, x, y) != s or side(cx, cy, ax, ay, x, y) != s:
                    continue
                v = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                place = np.searchsorted(zs, az + v * (bz - az) + w * (cz - az))
                change[i, j, place] -= s
