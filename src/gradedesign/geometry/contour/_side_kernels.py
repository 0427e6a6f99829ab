"""Compiled passes over the cubes of a grid by the side of a part on which they lie."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray

#: Cubes by where they lie.
NEAR, DEEP, BESIDE, BEYOND = 0, 1, 2, 3


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
