"""Compiled inside and outside of closed surfaces: at points, along lines and near cubes of grids.

A triangle covers a place of the plane by the directed edges that pass it on its right, each with
half-open ends and computed the same way for both triangles that share it. So the coverage of a
closed surface adds up to nothing exactly at every place, also through edges and corners, and a
winding number is whole whatever the coordinates are.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Share of a clearance that is free of rounding.
SURE = 1.0 - 1e-9
#: Points before a point that may have its winding number: those of a cube of 2 x 2 x 2.
_BACK = 8


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def windings(
    low, high, corners, tops, lower, step, shape, first, member, points, axes, clearance, result
):
    """Fill the winding number of points low to high of a (3, n) array.

    ``axes`` are the coordinates of points that the columns' three stand for. The surface is not
    nearer to a point than its ``clearance`` (n,): a point that lies within that of one of the few
    before, or one of these within that of it, has the same winding number.
    """
    for p in range(low, high):
        for q in range(p - 1, max(low, p - _BACK) - 1, -1):
            free, apart2 = SURE * max(clearance[q], clearance[p]), 0.0
            for a in range(3):
                apart2 += (points[a, p] - points[a, q]) ** 2
            if apart2 < free * free:
                result[p] = result[q]
                break
        else:
            x, y, z = points[axes[0], p], points[axes[1], p], points[axes[2], p]
            result[p] = winding_at(corners, tops, lower, step, shape, first, member, x, y, z)


@njit(cache=True, nogil=True)
def cross_lines(corners, shape, first, height, turn):
    """Meet lines along the third axis, one at every whole place, with triangles (m, 3, 3).

    Parameters
    ----------
    corners : (m, 3, 3) array
        First two coordinates in steps of the grid from its first line.
    shape : (2,) int array
        Lines along the first two axes.
    first : (lines + 1,) int array
        Filled with counts, one place late; with heights, where each line is filled next.
    height, turn : (k,) arrays, float and int
        Where a triangle covers a line, and 1 or -1 where it looks up or down; empty to count.
    """
    pad = 1e-6
    for t in range(len(corners)):
        least = min(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0]) - pad
        most = max(corners[t, 0, 0], corners[t, 1, 0], corners[t, 2, 0]) + pad
        for i in range(max(0, int(np.ceil(least))), min(shape[0] - 1, int(np.floor(most))) + 1):
            low, high = _strip(corners, t, i - pad, i + pad)
            if high < low:
                continue
            j0, j1 = int(np.ceil(low - pad)), int(np.floor(high + pad))
            for j in range(max(0, j0), min(shape[1] - 1, j1) + 1):
                covered = _coverage(corners, t, float(i), float(j))
                if covered == 0:
                    continue
                line = i * shape[1] + j
                if len(height):
                    height[first[line]] = _height(corners, t, float(i), float(j))
                    turn[first[line]] = covered
                    first[line] += 1
                else:
                    first[line + 1] += 1


@njit(cache=True, nogil=True)
def fill_inside(low, high, first, height, turn, inside, outside, marks):
    """Mark whole heights along lines by whether the winding number there is at least 1."""
    _, ny, nz = marks.shape
    steps = np.zeros(nz, dtype=np.int64)
    for i in range(low, high):
        for j in range(ny):
            for k in range(nz):
                steps[k] = 0
            for c in range(first[i * ny + j], first[i * ny + j + 1]):
                k = int(np.ceil(height[c])) - 1
                if k >= 0:
                    steps[min(k, nz - 1)] += turn[c]
            winding = np.int64(0)
            for k in range(nz - 1, -1, -1):
                winding += steps[k]
                marks[i, j, k] = inside if winding > 0 else outside


@njit(cache=True, nogil=True)
def line_lengths(first, height, turn):
    """Lengths along all lines with a winding number of at least 1, of its excess, and below 0.

    The fourth number is of lines that enter and leave unequally often: the surface is open there.
    """
    solid, excess, backward, torn = 0.0, 0.0, 0.0, 0
    for line in range(len(first) - 1):
        a, b = first[line], first[line + 1]
        order = a + np.argsort(height[a:b])
        winding = 0
        for n in range(b - a):
            length = height[order[n]] - height[order[n - 1]] if n else 0.0
            if winding > 0:
                solid += length
                excess += (winding - 1) * length
            else:
                backward -= winding * length
            winding -= turn[order[n]]
        torn += winding != 0
    return solid, excess, backward, torn


@njit(cache=True, nogil=True)
def meets_box(triangle, middle, half):
    """Whether a triangle (3 corners, 3) and a box have a point in common.

    By separating axes: T. Akenine-Moeller, "Fast 3D triangle-box overlap testing", Journal of
    Graphics Tools 6(1), 29-33, 2001.
    """
    p = triangle - middle
    for a in range(3):
        if p[:, a].min() > half[a] or p[:, a].max() < -half[a]:
            return False
    n, sides = np.zeros(3), np.zeros((3, 3))
    for c in range(3):
        for a in range(3):
            sides[c, a] = p[(c + 1) % 3, a] - p[c, a]
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        n[a] = sides[0, u] * sides[1, v] - sides[0, v] * sides[1, u]
    away = n[0] * p[0, 0] + n[1] * p[0, 1] + n[2] * p[0, 2]
    if abs(away) > abs(n[0]) * half[0] + abs(n[1]) * half[1] + abs(n[2]) * half[2]:
        return False
    for a in range(3):
        u, v = (a + 1) % 3, (a + 2) % 3
        for c in range(3):
            # The axis across a side of the triangle and one of the box.
            su, sv = sides[c, u], sides[c, v]
            low, high = np.inf, -np.inf
            for d in range(3):
                at = p[d, u] * sv - p[d, v] * su
                low, high = min(low, at), max(high, at)
            reach = abs(sv) * half[u] + abs(su) * half[v]
            if low > reach or high < -reach:
                return False
    return True


@njit(cache=True, nogil=True)
def mark_near(corners, clearance, mark, marks):
    """Mark the cubes of a grid that triangles (m, 3, 3), in cubes from its corner, come close to.

    Boxes of cubes are halved as long as the triangle meets them.
    """
    stack = np.zeros((256, 2, 3), dtype=np.int64)
    middle, half = np.zeros(3), np.zeros(3)
    for f in range(len(corners)):
        depth, empty = 1, False
        for a in range(3):
            low, high = corners[f, :, a].min() - clearance, corners[f, :, a].max() + clearance
            stack[0, 0, a] = max(int(np.floor(low)), 0)
            stack[0, 1, a] = min(int(np.floor(high)) + 1, marks.shape[a])
            empty |= stack[0, 0, a] >= stack[0, 1, a]
        if empty:
            continue
        while depth > 0:
            depth -= 1
            longest, size = 0, 0
            for a in range(3):
                first, last = stack[depth, 0, a], stack[depth, 1, a]
                middle[a], half[a] = 0.5 * (first + last), 0.5 * (last - first) + clearance
                if last - first > size:
                    longest, size = a, last - first
            if not meets_box(corners[f], middle, half):
                continue
            if size == 1:
                marks[stack[depth, 0, 0], stack[depth, 0, 1], stack[depth, 0, 2]] = mark
                continue
            cut = stack[depth, 0, longest] + size // 2
            for a in range(3):
                stack[depth + 1, 0, a] = stack[depth, 0, a]
                stack[depth + 1, 1, a] = stack[depth, 1, a]
            stack[depth, 1, longest] = cut
            stack[depth + 1, 0, longest] = cut
            depth += 2
