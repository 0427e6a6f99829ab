"""Compiled pixels of tiles of a layer, as places and back."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def tile_points(chosen, side, shape, pixel, points):
    """Fill x and y of the pixels of chosen tiles from the first pixel on, mm; how many.

    Tiles have ``side`` pixels along both axes; ``points`` is (3, n).
    """
    found = 0
    for a in range(chosen.shape[0]):
        for b in range(chosen.shape[1]):
            if not chosen[a, b]:
                continue
            for i in range(side * a, min(side * (a + 1), shape[0])):
                for j in range(side * b, min(side * (b + 1), shape[1])):
                    points[0, found] = i * pixel
                    points[1, found] = j * pixel
                    found += 1
    return found


@njit(cache=True, nogil=True)
def place_tiles(chosen, side, values, layer):
    """Write values in the order of `tile_points` into a layer."""
    found = 0
    for a in range(chosen.shape[0]):
        for b in range(chosen.shape[1]):
            if not chosen[a, b]:
                continue
            for i in range(side * a, min(side * (a + 1), layer.shape[0])):
                for j in range(side * b, min(side * (b + 1), layer.shape[1])):
                    layer[i, j] = values[found]
                    found += 1
