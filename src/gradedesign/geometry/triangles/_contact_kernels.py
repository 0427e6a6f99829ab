"""Compiled search for triangles that lie on each other, turned against each other."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._collapse_kernels import between
from gradedesign.geometry.triangles._tree_kernels import DEPTH, next_leaf

#: Cosine of the angle between normals of triangles that may lie on each other: 8 degrees. How far
#: apart they are where they overlap is tested besides.
_OPPOSITE = -0.99


@njit(cache=True, nogil=True)
def _clip(polygon, size, spare, ox, oy, oz, nx, ny, nz):
    """Keep the part of a convex polygon in front of a plane; returns its number of points."""
    kept = 0
    for k in range(size):
        m = (k + 1) % size
        here = (polygon[k, 0] - ox) * nx + (polygon[k, 1] - oy) * ny + (polygon[k, 2] - oz) * nz
        there = (polygon[m, 0] - ox) * nx + (polygon[m, 1] - oy) * ny + (polygon[m, 2] - oz) * nz
        if here >= 0.0:
            for a in range(3):
                spare[kept, a] = polygon[k, a]
            kept += 1
        if (here >= 0.0) != (there >= 0.0):
            share = here / (here - there)
            for a in range(3):
                spare[kept, a] = polygon[k, a] + share * (polygon[m, a] - polygon[k, a])
            kept += 1
    for k in range(kept):
        for a in range(3):
            polygon[k, a] = spare[k, a]
    return kept


@njit(cache=True, nogil=True)
def _common(corners, normals, large, small, polygon, spare, found):
    """Fill area, largest distance and centroid of what a triangle covers of a larger one."""
    nx, ny, nz = normals[large, 0], normals[large, 1], normals[large, 2]
    for k in range(3):
        for a in range(3):
            polygon[k, a] = corners[small, k, a]
    size = 3
    for k in range(3):
        m = (k + 1) % 3
        ex = corners[large, m, 0] - corners[large, k, 0]
        ey = corners[large, m, 1] - corners[large, k, 1]
        ez = corners[large, m, 2] - corners[large, k, 2]
        size = _clip(
            polygon, size, spare, corners[large, k, 0], corners[large, k, 1], corners[large, k, 2],
            ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex,
        )  # fmt: skip
        if size < 3:
            found[0] = 0.0
            return
    area, away = 0.0, 0.0
    for a in range(3):
        found[2 + a] = 0.0
    for k in range(size):
        height = 0.0
        for a in range(3):
            height += (polygon[k, a] - corners[large, 0, a]) * normals[large, a]
            found[2 + a] += polygon[k, a] / size
        away = max(away, abs(height))
    for k in range(1, size - 1):
        ux, uy, uz = between(polygon, 0, k)
        vx, vy, vz = between(polygon, 0, k + 1)
        area += 0.5 * (
            (uy * vz - uz * vy) * nx + (uz * vx - ux * vz) * ny + (ux * vy - uy * vx) * nz
        )
    found[0], found[1] = abs(area), away


@njit(cache=True, nogil=True)
def _touches(faces, corners, normals, areas, longest, i, j, reach, polygon, spare, found):
    """Whether two triangles that share no edge lie on each other, turned against each other."""
    dot = 0.0
    for a in range(3):
        dot += normals[i, a] * normals[j, a]
    if dot > _OPPOSITE:
        return False
    common = 0
    for k in range(3):
        for m in range(3):
            if faces[i, k] == faces[j, m]:
                common += 1
    if common >= 2:
        return False
    large, small = (i, j) if areas[i] >= areas[j] else (j, i)
    _common(corners, normals, large, small, polygon, spare, found)
    return found[0] > reach * longest[small] and found[1] <= reach


@njit(cache=True, nogil=True)
def _partners(
    faces, corners, normals, areas, longest, box, right, first, count, order, i, reach, stack,
    polygon, spare, found, low, high, at, second, values,
):  # fmt: skip
    """Count the triangles of higher number on triangle i; fill them in from ``at`` on, if >= 0."""
    for a in range(3):
        x, y, z = corners[i, 0, a], corners[i, 1, a], corners[i, 2, a]
        low[a], high[a] = min(x, y, z) - reach, max(x, y, z) + reach
    stack[0], depth, number = 0, 1, 0
    while depth > 0:
        node, depth = next_leaf(box, right, low, high, stack, depth)
        if node < 0:
            break
        for s in range(first[node], first[node] + count[node]):
            j = order[s]
            if j > i and _touches(
                faces, corners, normals, areas, longest, i, j, reach, polygon, spare, found
            ):
                if at >= 0:
                    second[at + number] = j
                    for a in range(5):
                        values[at + number, a] = found[a]
                number += 1
    return number


@njit(cache=True, nogil=True)
def find_partners(
    begin, end, faces, corners, normals, areas, longest, box, right, first, count, order, reach,
    start, partners, second, values,
):  # fmt: skip
    """Fill the number of partners of every triangle or, from their starts on, the partners.

    Parameters
    ----------
    start : (m,) int array
        -1 while they are counted.
    partners : (m,) int array
    second : (k,) int array
    values : (k, 5) array
        Area, mm^2, distance, mm, and centroid, mm, of what both cover.
    """
    stack = np.zeros(DEPTH, dtype=np.int64)
    polygon, spare = np.zeros((12, 3)), np.zeros((12, 3))
    found, low, high = np.zeros(5), np.zeros(3), np.zeros(3)
    for i in range(begin, end):
        partners[i] = _partners(
            faces, corners, normals, areas, longest, box, right, first, count, order, i, reach,
            stack, polygon, spare, found, low, high, start[i], second, values,
        )  # fmt: skip
