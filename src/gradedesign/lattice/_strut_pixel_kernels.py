"""Compiled solid pixels of one plane of a strut lattice, and its field at some of them."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit

from gradedesign.lattice._strut_kernels import trimmed_value

#: Pixels along the edge of the largest tiles, as a power of two.
LEVELS = 4
#: Tiles of one sign are this much smaller than the distance within which the sign is the same.
_CLEAR = 1.0 - 1e-9


@njit(cache=True)
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
        As `gradedesign.lattice._strut_kernels.fill_values` takes them.
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
    tiles = np.zeros((4 * LEVELS + 4, 3), dtype=np.int64)
    nx, ny = solid.shape
    wide = 1 << LEVELS
    for i in range(0, nx, wide):
        for j in range(0, ny, wide):
            tiles[0, 0], tiles[0, 1], tiles[0, 2], depth = i, j, wide, 1
            while depth > 0:
                depth -= 1
                p, q, side = tiles[depth, 0], tiles[depth, 1], tiles[depth, 2]
                if p >= nx or q >= ny:
                    continue
                middle = 0.5 * (side - 1)
                x, y, z = _place(frame, lower, pixel, p + middle, q + middle)
                value, clear = trimmed_value(
                    bins, first, member, strut, matrix, start, scale, level, steep,
                    tri, flat, ball, normals, origin, edge, slot, bound, begin, listed,
                    thickness, exact, depths, 1 if side == 1 else 2, x, y, z, stack, ends,
                )  # fmt: skip
                if side == 1:
                    solid[p, q] = value < 0.0
                elif clear * _CLEAR > math.sqrt(2.0) * middle * pixel:
                    if value < 0.0:
                        solid[p : p + side, q : q + side] = True
                else:
                    half = side // 2
                    for k in range(4):
                        tiles[depth, 0] = p + half * (k % 2)
                        tiles[depth, 1] = q + half * (k // 2)
                        tiles[depth, 2] = half
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
                    thickness, exact, depths, 0, x, y, z, stack, ends,
                )[0]  # fmt: skip
                found += 1
