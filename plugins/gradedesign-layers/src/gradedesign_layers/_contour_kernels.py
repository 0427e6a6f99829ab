"""Compiled contours of layers: marching squares, and the areas that they enclose."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign_layers._run_kernels import beside_change

#: A point within this distance of the line between its neighbours is left out, steps.
STRAIGHT = 1e-4

#: Side of a square on which a contour leaves it, by its solid corners (bits: lower left, lower
#: right, upper right, upper left) and the side on which it enters; sides: 0 below, 1 right, 2
#: above, 3 left; the solid is on the left. Solid corners that touch across a square are apart.
_LEAVES = np.full((16, 4), -1, dtype=np.int8)
for _code, _from, _to in (
    (1, 0, 3), (2, 1, 0), (4, 2, 1), (8, 3, 2), (3, 1, 3), (6, 2, 0), (12, 3, 1), (9, 0, 2),
    (14, 3, 0), (13, 0, 1), (11, 1, 2), (7, 2, 3), (5, 0, 3), (5, 2, 1), (10, 1, 0), (10, 3, 2),
):  # fmt: skip
    _LEAVES[_code, _from] = _to


@njit(cache=True, nogil=True)
def spread_values(solid, beside, clear, far, values):
    """Values of a layer for its contours: those of ``beside`` where pixels change, else ``far``.

    Of size ``clear`` at least, and negative where the pixel is solid.
    """
    nx, ny = solid.shape
    near = np.zeros((nx, ny), dtype=np.bool_)
    beside_change(solid, near)
    found = 0
    for i in range(nx):
        for j in range(ny):
            value = far
            if near[i, j]:
                value = max(abs(float(beside[found])), clear)
                found += 1
            values[i, j] = -value if solid[i, j] else value


@njit(cache=True, nogil=True)
def trace(values, stamp, number, places, first, scratch):
    """Closed contours of a layer, without the points on lines between their neighbours.

    Parameters
    ----------
    values : (nx, ny) array
        Negative in the solid, positive along the border, nowhere 0.
    stamp : (nx, ny) int32 array
        Layer that the contour through the edge along x behind a pixel was traced for last.
    number : int
        Of this layer.
    places : (k, 2) array
        Filled: points, in steps of the grid.
    first : (m,) int array
        Filled: where each polygon begins; the number of points follows the last.
    scratch : (k, 2) array

    Returns
    -------
    int
        Number of polygons; -1 where the arrays have no room.
    """
    nx, ny = values.shape
    found, filled = 0, 0
    for i in range(nx - 1):
        for j in range(ny):
            if stamp[i, j] == number or (values[i, j] < 0.0) == (values[i + 1, j] < 0.0):
                continue
            # Solid on the left: upwards into the square above, or down into the one below.
            a, b, side = (i, j, 0) if values[i, j] < 0.0 else (i, j - 1, 2)
            count = 0
            while True:
                along_y = side == 1 or side == 3
                p, q = a + (side == 1), b + (side == 2)
                if not along_y:
                    if stamp[p, q] == number:
                        break
                    stamp[p, q] = number
                if count >= len(scratch):
                    return -1
                here = values[p, q]
                there = values[p, q + 1] if along_y else values[p + 1, q]
                share = here / (here - there)
                scratch[count, 0] = p if along_y else p + share
                scratch[count, 1] = q + share if along_y else q
                count += 1
                code = (
                    (values[a, b] < 0.0)
                    + 2 * (values[a + 1, b] < 0.0)
                    + 4 * (values[a + 1, b + 1] < 0.0)
                    + 8 * (values[a, b + 1] < 0.0)
                )
                leaves = _LEAVES[code, side]
                a += (leaves == 1) - (leaves == 3)
                b += (leaves == 2) - (leaves == 0)
                side = (leaves + 2) % 4
            if found + 1 >= len(first) or filled + count > len(places):
                return -1
            first[found] = filled
            filled += _bent(scratch, count, places, filled)
            found += 1
    first[found] = filled
    return found


@njit(cache=True)
def _bent(polygon, count, places, filled):
    """Copy the points of a polygon off the lines between their neighbours; all if fewer than 3."""
    kept = 0
    for n in range(count):
        before, after = (n - 1) % count, (n + 1) % count
        cx, cy = polygon[after, 0] - polygon[before, 0], polygon[after, 1] - polygon[before, 1]
        dx, dy = polygon[n, 0] - polygon[before, 0], polygon[n, 1] - polygon[before, 1]
        if abs(cx * dy - cy * dx) > STRAIGHT * max(np.hypot(cx, cy), 1e-12):
            places[filled + kept] = polygon[n]
            kept += 1
    if kept >= 3:
        return kept
    places[filled : filled + count] = polygon[:count]
    return count


@njit(cache=True, nogil=True)
def polygon_areas(places, first, areas):
    """Fill the areas enclosed by polygons, negative where they run clockwise."""
    for n in range(len(areas)):
        low, high = first[n], first[n + 1]
        x0, y0 = places[low]
        twice = 0.0
        for m in range(low, high):
            after = m + 1 if m + 1 < high else low
            twice += (places[m, 0] - x0) * (places[after, 1] - y0)
            twice -= (places[m, 1] - y0) * (places[after, 0] - x0)
        areas[n] = 0.5 * twice
