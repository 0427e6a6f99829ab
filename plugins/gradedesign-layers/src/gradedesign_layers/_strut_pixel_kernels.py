"""Compiled solid pixels of one plane of a strut lattice, and its field at some of them."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit

from gradedesign_layers._strut_kernels import (
    REACH,
    TIED,
    cell_value,
    foot_of,
    least_sample,
    refined,
    trimmed_value,
)
from gradedesign_layers._surface_band_kernels import cube_of, nearest_listed

#: Pixels along the edge of the largest tiles, as a power of two.
LEVELS = 4
#: Distances within which the sign is the same are taken this much smaller, mm: they are rounded.
_ROUNDING = 1e-6
#: A value of at most this is negative, mm.
_NEGATIVE = -1e-300
#: Distances of the middles of cubes are rounded by less, mm.
_FLOAT32 = 1e-4
#: Least values below feet are known, to this many pixels, for use at other feet.
_KEPT = 2.0


@njit(cache=True, inline="always")
def _sign(
    bins, first, member, strut, matrix, start, scale, level, steep,
    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
    thickness, exact, depths, x, y, z, most, single, seen, stack, ends,
):  # fmt: skip
    """A value of the trimmed lattice's sign, how far it is the same, the part's distance at most.

    ``most`` is known to be above the part's signed distance. Unless the point is a ``single`` one,
    the net-skin is not looked at, and the sign is right only where it is the same farther than 0.
    """
    distance, s = most, 0
    if most >= -thickness:
        a, b, c = cube_of(origin, edge, slot.shape, x, y, z)
        if a < 0:
            return exact, exact, most
        s = slot[a, b, c]
        if s < 0:
            distance = min(most, float(bound[a, b, c]))
            if distance > 0.0:
                return distance, distance, distance
        else:
            dx = x - origin[0] - edge * (a + 0.5)
            dy = y - origin[1] - edge * (b + 0.5)
            dz = z - origin[2] - edge * (c + 0.5)
            around = math.sqrt(dx * dx + dy * dy + dz * dz) + _FLOAT32
            middle = float(bound[a, b, c])
            if middle > around:
                return middle, middle - around, middle + around
            distance = min(distance, middle + around)
    value = cell_value(bins, first, member, strut, matrix, start, scale, level, x, y, z)
    if value < 0.0 and distance < 0.0:
        return value, min(-value / steep, -distance), distance
    if distance < -thickness:
        return value, min(value / steep, -distance - thickness), distance
    distance, toward, normal, t, feature = nearest_listed(
        tri, flat, ball, normals, listed, begin[s], begin[s + 1], x, y, z
    )
    if distance >= 0.0:
        return distance, distance, distance
    if value < 0.0:
        return value, min(-value / steep, -distance), distance
    if distance <= -thickness:
        return value, min(value / steep, -distance - thickness), distance
    if not single or not len(depths):
        return value, 0.0, distance
    foot, out = foot_of(distance, toward, normal, x, y, z)
    refining = REACH * steep * (depths[1] - depths[0])
    # Below one face all feet look along one line: values there have the largest slope too.
    if feature == 0 and seen[t, 3] != 0.0:
        dx, dy, dz = foot[0] - seen[t, 0], foot[1] - seen[t, 1], foot[2] - seen[t, 2]
        change = steep * math.sqrt(dx * dx + dy * dy + dz * dz) + _ROUNDING
        if seen[t, 3] + change < 0.0:
            return seen[t, 3], 0.0, distance
        if seen[t, 3] - change > refining:
            return seen[t, 3], 0.0, distance
    limit = _KEPT * exact + refining
    least, best = least_sample(
        bins, first, member, strut, matrix, start, scale, level, steep,
        foot, out, depths, -_KEPT * exact, limit, stack, ends,
    )  # fmt: skip
    if feature == 0:
        seen[t, 0], seen[t, 1], seen[t, 2] = foot
        seen[t, 3] = least if least < 0.0 else min(least, limit) - TIED
    if 0.0 <= least <= refining + TIED:
        least = refined(
            bins, first, member, strut, matrix, start, scale, level,
            foot, out, depths, least, best, _NEGATIVE,
        )  # fmt: skip
    return least, 0.0, distance


@njit(cache=True, inline="always")
def _place(frame, lower, pixel, i, j):
    """Centre of a pixel in the axes of the part, mm."""
    x, y, z = i * pixel + lower[0], j * pixel + lower[1], lower[2]
    return (
        frame[0, 0] * x + frame[1, 0] * y + frame[2, 0] * z,
        frame[0, 1] * x + frame[1, 1] * y + frame[2, 1] * z,
        frame[0, 2] * x + frame[1, 2] * y + frame[2, 2] * z,
    )


@njit(cache=True, nogil=True)
def fill_solid(cells, band, thickness, exact, depths, frame, lower, pixel, solid):
    """Mark the solid pixels of an empty plane, tiles of one sign at once.

    The part's distance and the struts' field have largest slopes: around the middle of a tile the
    sign is the same within a known distance. Where that holds the tile it is filled, else halved.

    Parameters
    ----------
    cells, band, thickness, exact, depths
        As `gradedesign_layers._strut_kernels.fill_values` takes them.
    frame : (3, 3) array
        Rows are the axes of the plane and across it.
    lower : (3,) array, mm
        Centre of the first pixel in these axes.
    pixel : float, mm
    solid : (nx, ny) bool array
    """
    bins, first, member, strut, matrix, start, scale, level, steep = cells
    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed = band
    stack = np.zeros((len(depths) + 2, 2), dtype=np.int64)
    ends = np.zeros((len(depths) + 2, 2))
    tiles = np.zeros((3 * LEVELS + 1, 3), dtype=np.int64)
    above = np.zeros(len(tiles))
    seen = np.zeros((len(tri), 4))
    nx, ny = solid.shape
    wide = 1 << LEVELS
    for i in range(0, nx, wide):
        for j in range(0, ny, wide):
            tiles[0, 0], tiles[0, 1], tiles[0, 2], depth = i, j, wide, 1
            above[0] = np.inf
            while depth > 0:
                depth -= 1
                p, q, side = tiles[depth, 0], tiles[depth, 1], tiles[depth, 2]
                if p >= nx or q >= ny:
                    continue
                middle = 0.5 * (side - 1)
                x, y, z = _place(frame, lower, pixel, p + middle, q + middle)
                value, clear, distance = _sign(
                    bins, first, member, strut, matrix, start, scale, level, steep,
                    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
                    thickness, exact, depths, x, y, z, above[depth], side == 1, seen, stack, ends,
                )  # fmt: skip
                across = math.sqrt(2.0) * middle * pixel
                if side == 1:
                    solid[p, q] = value < 0.0
                elif clear > across + _ROUNDING:
                    if value < 0.0:
                        solid[p : p + side, q : q + side] = True
                else:
                    half = side // 2
                    for k in range(4):
                        tiles[depth, 0] = p + half * (k % 2)
                        tiles[depth, 1] = q + half * (k // 2)
                        tiles[depth, 2] = half
                        above[depth] = distance + across + _ROUNDING
                        depth += 1


@njit(cache=True, nogil=True)
def fill_chosen(cells, band, thickness, exact, depths, frame, lower, pixel, chosen, value):
    """Fill the field at chosen pixels (nx, ny) of a plane, row by row; see `fill_solid`."""
    bins, first, member, strut, matrix, start, scale, level, steep = cells
    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed = band
    stack = np.zeros((len(depths) + 2, 2), dtype=np.int64)
    ends = np.zeros((len(depths) + 2, 2))
    found = 0
    for i in range(chosen.shape[0]):
        for j in range(chosen.shape[1]):
            if chosen[i, j]:
                x, y, z = _place(frame, lower, pixel, i, j)
                value[found] = trimmed_value(
                    bins, first, member, strut, matrix, start, scale, level, steep,
                    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
                    thickness, exact, depths, x, y, z, stack, ends,
                )  # fmt: skip
                found += 1
