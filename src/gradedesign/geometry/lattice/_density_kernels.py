"""Compiled trilinear interpolation on a node grid."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray


@njit(cache=True, nogil=True)
def trilinear(
    values: FloatArray, origin: FloatArray, spacing: float, points: FloatArray
) -> FloatArray:
    """Node values interpolated at points ``(3, n)``, constant beyond the outer nodes."""
    count = points.shape[1]
    result = np.zeros(count)
    corner = np.zeros(3, dtype=np.int64)
    step = np.zeros(3, dtype=np.int64)
    share = np.zeros(3)
    for p in range(count):
        for axis in range(3):
            last = values.shape[axis] - 1
            x = (points[axis, p] - origin[axis]) / spacing
            x = min(max(x, 0.0), float(last))
            low = min(int(x), max(last - 1, 0))
            corner[axis] = low
            step[axis] = 1 if last > 0 else 0
            share[axis] = x - low
        i, j, k = corner[0], corner[1], corner[2]
        a, b, c = i + step[0], j + step[1], k + step[2]
        x, y, z = share[0], share[1], share[2]
        low_x = values[i, j, k] + x * (values[a, j, k] - values[i, j, k])
        up_x = values[i, b, k] + x * (values[a, b, k] - values[i, b, k])
        front = low_x + y * (up_x - low_x)
        low_x = values[i, j, c] + x * (values[a, j, c] - values[i, j, c])
        up_x = values[i, b, c] + x * (values[a, b, c] - values[i, b, c])
        back = low_x + y * (up_x - low_x)
        result[p] = front + z * (back - front)
    return result


@njit(cache=True, nogil=True)
def nearest_bounds(
    nodes: FloatArray,
    origin: FloatArray,
    spacing: float,
    points: FloatArray,
    inner: float,
    outer: float,
) -> tuple[FloatArray, int]:
    """Bounds on a 1-Lipschitz function from its values at grid nodes, at points ``(3, n)``.

    Where the function is surely above ``outer`` the result is a lower bound, where it is surely
    below ``-inner`` an upper bound, elsewhere NaN; also returns the number of NaN.
    """
    count = points.shape[1]
    result = np.zeros(count)
    unsure = 0
    index = np.zeros(3, dtype=np.int64)
    for p in range(count):
        square = 0.0
        for axis in range(3):
            x = (points[axis, p] - origin[axis]) / spacing
            at = int(np.floor(min(max(x, 0.0), nodes.shape[axis] - 1.0) + 0.5))
            index[axis] = at
            square += (x - at) ** 2
        apart = spacing * np.sqrt(square)
        value = nodes[index[0], index[1], index[2]]
        if value - apart > outer:
            result[p] = value - apart
        elif value + apart < -inner:
            result[p] = value + apart
        else:
            result[p] = np.nan
            unsure += 1
    return result, unsure
