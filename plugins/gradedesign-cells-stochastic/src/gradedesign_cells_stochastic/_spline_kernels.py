"""Compiled cubic splines of period 1 on a grid."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

from numba import njit, prange

#: Points per unit of threaded work; fixed, so that results do not depend on the threads.
CHUNK = 4096


@njit(cache=True, inline="always")
def weights(t):
    """Uniform cubic B-spline at the four nodes around a place t past the second."""
    r = 1.0 - t
    return (
        r * r * r / 6.0,
        2.0 / 3.0 - 0.5 * t * t * (2.0 - t),
        2.0 / 3.0 - 0.5 * r * r * (2.0 - r),
        t * t * t / 6.0,
    )


@njit(cache=True, parallel=True, nogil=True)
def spline_values(points, table, value):
    """Evaluate a spline at points (3, n) of period 1, into value (n,).

    ``table`` holds its coefficients at nodes -1 to m + 1, ``(m + 3, m + 3, m + 3)``.
    """
    count = points.shape[1]
    m = table.shape[0] - 3
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        for i in range(chunk * CHUNK, min((chunk + 1) * CHUNK, count)):
            x = (points[0, i] - math.floor(points[0, i])) * m
            y = (points[1, i] - math.floor(points[1, i])) * m
            z = (points[2, i] - math.floor(points[2, i])) * m
            # A tiny negative coordinate rounds to 1, which is the far side of the last step.
            a = min(int(x), m - 1)
            b = min(int(y), m - 1)
            c = min(int(z), m - 1)
            wx = weights(x - a)
            wy = weights(y - b)
            wz = weights(z - c)
            total = 0.0
            for p in range(4):
                for q in range(4):
                    row = table[a + p, b + q]
                    line = wz[0] * row[c] + wz[1] * row[c + 1]
                    line += wz[2] * row[c + 2] + wz[3] * row[c + 3]
                    total += wx[p] * wy[q] * line
            value[i] = total
