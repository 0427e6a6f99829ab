"""Compiled cubic splines and trilinear interpolation of period 1."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True, inline="always")
def split(coordinate, steps, start):
    """Grid step of a coordinate of period 1, and the place in it."""
    place = (coordinate - math.floor(coordinate)) * steps - start
    step = math.floor(place)
    return int(step), place - step


@njit(cache=True, nogil=True, inline="always")
def spline_weights(t):
    """Uniform cubic B-spline at the four nodes around a place t past the second."""
    r = 1.0 - t
    return (
        r * r * r / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0,
        t * t * t / 6.0,
    )


@njit(cache=True, nogil=True)
def spline_values(low, high, points, table, start, value):
    """Evaluate at a range of points (3, n), into value (n,).

    ``table`` holds coefficients at nodes -2 to m + 2, by axis; node i lies at ``(i + start) / m``.
    """
    for i in range(low, high):
        a, x = split(points[0, i], table.shape[0] - 5, start)
        b, y = split(points[1, i], table.shape[1] - 5, start)
        c, z = split(points[2, i], table.shape[2] - 5, start)
        along_x, along_y, along_z = spline_weights(x), spline_weights(y), spline_weights(z)
        total = 0.0
        for p in range(4):
            for q in range(4):
                row = table[a + 1 + p, b + 1 + q]
                part = (
                    along_z[0] * row[c + 1]
                    + along_z[1] * row[c + 2]
                    + along_z[2] * row[c + 3]
                    + along_z[3] * row[c + 4]
                )
                total += along_x[p] * along_y[q] * part
        value[i] = total


@njit(cache=True, nogil=True)
def linear_values(low, high, points, table, start, value):
    """Trilinear interpolation; arguments as in `spline_values`, with values in the table."""
    for i in range(low, high):
        a, x = split(points[0, i], table.shape[0] - 5, start)
        b, y = split(points[1, i], table.shape[1] - 5, start)
        c, z = split(points[2, i], table.shape[2] - 5, start)
        total = 0.0
        for p in range(2):
            for q in range(2):
                row = table[a + 2 + p, b + 2 + q]
                weight = (x if p else 1.0 - x) * (y if q else 1.0 - y)
                total += weight * ((1.0 - z) * row[c + 2] + z * row[c + 3])
        value[i] = total
