"""Compiled search for the cubes of a grid that a part's triangles meet, and for the two sides."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray

#: Cubes by where they lie; `UNKNOWN` until it is found out.
NEAR, DEEP, BESIDE, BEYOND, UNKNOWN = 0, 1, 2, 3, 4


@njit(cache=True, nogil=True)
def meets_box(triangle: FloatArray, middle: FloatArray, half: FloatArray) -> bool:
    """Whether a triangle (3 corners, 3) and a box have a point in common.

    By separating axes: T. Akenine-Moeller, "Fast 3D triangle-box overlap testing", Journal of
    Graphics Tools 6(1), 29-33, 2001.
    """
    p = np.zeros((3, 3))
    for a in range(3):
        low, high = np.inf, -np.inf
        for c in range(3):
            p[c, a] = triangle[c, a] - middle[a]
            low, high = min(low, p[c, a]), max(high, p[c, a])
        if low > half[a] or high < -half[a]:
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
def mark_near(corners: FloatArray, clearance: float, sides: NDArray[np.uint8]) -> None:
    """Mark as near the cubes that triangles (m, 3, 3), in cubes from the first node, come close to.

    Boxes of cubes are halved as long as the triangle meets them.
    """
    stack = np.zeros((256, 2, 3), dtype=np.int64)
    middle, half = np.zeros(3), np.zeros(3)
    for f in range(len(corners)):
        depth, empty = 1, False
        for a in range(3):
            x, y, z = corners[f, 0, a], corners[f, 1, a], corners[f, 2, a]
            low, high = min(x, y, z) - clearance, max(x, y, z) + clearance
            stack[0, 0, a] = max(int(np.floor(low)), 0)
            stack[0, 1, a] = min(int(np.floor(high)) + 1, sides.shape[a])
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
                sides[stack[depth, 0, 0], stack[depth, 0, 1], stack[depth, 0, 2]] = NEAR
                continue
            cut = stack[depth, 0, longest] + size // 2
            for a in range(3):
                stack[depth + 1, 0, a], stack[depth + 1, 1, a] = (
                    stack[depth, 0, a],
                    stack[depth, 1, a],
                )
            stack[depth, 1, longest] = cut
            stack[depth + 1, 0, longest] = cut
            depth += 2


@njit(cache=True, nogil=True)
def next_unknown(sides: NDArray[np.uint8], start: int) -> int:
    """Flat number of the first unknown cube from ``start`` on; -1 without one."""
    flat = sides.ravel()  # a view: the array is contiguous
    for n in range(start, len(flat)):
        if flat[n] == UNKNOWN:
            return n
    return -1


@njit(cache=True, nogil=True)
def flood_unknown(sides: NDArray[np.uint8], start: int, value: int) -> None:
    """Give a value to an unknown cube, by its flat number, and to all unknown ones joined to it.

    Cubes are joined by their faces; lines of them along the last axis are filled at once.
    """
    nx, ny, nz = sides.shape
    stack = np.zeros(1024, dtype=np.int64)
    stack[0], depth = start, 1
    while depth > 0:
        depth -= 1
        n = stack[depth]
        i, j, k = n // (ny * nz), n // nz % ny, n % nz
        if sides[i, j, k] != UNKNOWN:
            continue
        first, last = k, k
        while first > 0 and sides[i, j, first - 1] == UNKNOWN:
            first -= 1
        while last + 1 < nz and sides[i, j, last + 1] == UNKNOWN:
            last += 1
        for k in range(first, last + 1):
            sides[i, j, k] = value
        for way in range(4):
            p, q = i + (way == 0) - (way == 1), j + (way == 2) - (way == 3)
            if p < 0 or q < 0 or p == nx or q == ny:
                continue
            before = False
            for k in range(first, last + 1):
                here = sides[p, q, k] == UNKNOWN
                if here and not before:
                    if depth == len(stack):
                        longer = np.zeros(2 * depth, dtype=np.int64)
                        for s in range(depth):
                            longer[s] = stack[s]
                        stack = longer
                    stack[depth] = (p * ny + q) * nz + k
                    depth += 1
                before = here


@njit(cache=True, nogil=True)
def take_out_edges(sides: NDArray[np.uint8]) -> int:
    """Mark near one of each two cubes that meet in an edge between two near cubes."""
    taken = 0
    nx, ny, nz = sides.shape
    for axis in range(3):
        u = (int(axis != 0), int(axis == 0), 0)  # the two other axes
        v = (0, int(axis == 2), int(axis != 2))
        for i in range(nx - u[0] - v[0]):
            for j in range(ny - u[1] - v[1]):
                for k in range(nz - u[2] - v[2]):
                    here = sides[i, j, k] != NEAR
                    across = sides[i + u[0] + v[0], j + u[1] + v[1], k + u[2] + v[2]] != NEAR
                    if here != across:
                        continue
                    beside_u = sides[i + u[0], j + u[1], k + u[2]] != NEAR
                    beside_v = sides[i + v[0], j + v[1], k + v[2]] != NEAR
                    if beside_u != beside_v or beside_u == here:
                        continue
                    if here:
                        sides[i, j, k] = NEAR
                    else:
                        sides[i + u[0], j + u[1], k + u[2]] = NEAR
                    taken += 1
    return taken


@njit(cache=True, nogil=True)
def mark_beside(sides: NDArray[np.uint8]) -> None:
    """Mark the cubes beyond the part that touch a near one."""
    nx, ny, nz = sides.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if sides[i, j, k] != NEAR:
                    continue
                for p in range(max(i - 1, 0), min(i + 2, nx)):
                    for q in range(max(j - 1, 0), min(j + 2, ny)):
                        for r in range(max(k - 1, 0), min(k + 2, nz)):
                            if sides[p, q, r] == BEYOND:
                                sides[p, q, r] = BESIDE


@njit(cache=True, nogil=True)
def touching(
    sides: NDArray[np.uint8], points: FloatArray, origin: FloatArray, h: float
) -> BoolArray:
    """Which points (3, n) touch a cube that is not beyond the part, ``(n,)``."""
    touches = np.zeros(points.shape[1], dtype=np.bool_)
    low, high = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for n in range(points.shape[1]):
        for a in range(3):
            at = (points[a, n] - origin[a]) / h
            low[a] = max(int(at - 1e-6), 0)
            high[a] = min(int(at + 1e-6), sides.shape[a] - 1)
        if sides[min(low[0], high[0]), min(low[1], high[1]), min(low[2], high[2])] != BEYOND:
            touches[n] = True  # most points
            continue
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    touches[n] |= sides[i, j, k] != BEYOND
    return touches


@njit(cache=True, nogil=True)
def centre(number: int, shape: IntArray) -> FloatArray:
    """Centre of a cube by its flat number, in cubes from the first node, ``(3,)``."""
    nz, ny = shape[2], shape[1]
    return np.array([number // (ny * nz) + 0.5, number // nz % ny + 0.5, number % nz + 0.5])
