"""Compiled sum of Gaussian line integrals near each point, and periodic cubic splines."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

#: Points per unit of threaded work; fixed, so that results do not depend on the threads.
CHUNK = 4096


@njit(cache=True, inline="always")
def between(a, b):
    """Return erf(a) - erf(b) for a > b, without cancellation far from 0."""
    if b > 0.0:
        return math.erfc(b) - math.erfc(a)
    if a < 0.0:
        return math.erfc(-a) - math.erfc(-b)
    return math.erf(a) - math.erf(b)


@njit(cache=True, inline="always")
def foot(x, y, z, k, start, axis, length):
    """Place along segment k, squared distance to its line and to itself."""
    dx = x - start[k, 0]
    dy = y - start[k, 1]
    dz = z - start[k, 2]
    s = dx * axis[k, 0] + dy * axis[k, 1] + dz * axis[k, 2]
    beyond = max(0.0, -s, s - length[k])
    h2 = max(dx * dx + dy * dy + dz * dz - s * s, 0.0)
    return s, h2, h2 + beyond * beyond


@njit(cache=True, parallel=True, nogil=True)
def line_integrals(points, bins, first, member, start, axis, length, sigma, cut_off, value):
    """Sum over segments of period 1 at points (3, n), into value (n,); see `line_convolution`.

    A segment counts unless its squared distance exceeds that of the nearest one by more than
    ``(cut_off sigma)^2``.
    """
    count = points.shape[1]
    scale = sigma * math.sqrt(0.5 * math.pi)
    inverse = 1.0 / (sigma * math.sqrt(2.0))
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        for i in range(chunk * CHUNK, min((chunk + 1) * CHUNK, count)):
            x = points[0, i] - math.floor(points[0, i])
            y = points[1, i] - math.floor(points[1, i])
            z = points[2, i] - math.floor(points[2, i])
            # A tiny negative coordinate rounds to 1, which is the far side of the last bin.
            a = min(int(x * bins), bins - 1)
            b = min(int(y * bins), bins - 1)
            c = min(int(z * bins), bins - 1)
            place = (a * bins + b) * bins + c
            limit = np.inf
            for entry in range(first[place], first[place + 1]):
                limit = min(limit, foot(x, y, z, member[entry], start, axis, length)[2])
            limit += (cut_off * sigma) ** 2
            total = 0.0
            for entry in range(first[place], first[place + 1]):
                k = member[entry]
                s, h2, away = foot(x, y, z, k, start, axis, length)
                if away <= limit:
                    ends = between(s * inverse, (s - length[k]) * inverse)
                    total += math.exp(-h2 * inverse * inverse) * ends
            value[i] = scale * total


@njit(cache=True, inline="always")
def spline_weights(t):
    """Uniform cubic B-spline at the four nodes around a place t past the second."""
    r = 1.0 - t
    return (
        r * r * r / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0,
        t * t * t / 6.0,
    )


@njit(cache=True, parallel=True, nogil=True)
def spline_values(points, table, value):
    """Evaluate a cubic spline of period 1 at points (3, n), into value (n,).

    ``table`` holds coefficients at nodes -1 to m + 1, ``(m + 3, m + 3, m + 3)``.
    """
    count = points.shape[1]
    m = table.shape[0] - 3
    for chunk in prange((count + CHUNK - 1) // CHUNK):
        for i in range(chunk * CHUNK, min((chunk + 1) * CHUNK, count)):
            x = (points[0, i] - math.floor(points[0, i])) * m
            y = (points[1, i] - math.floor(points[1, i])) * m
            z = (points[2, i] - math.floor(points[2, i])) * m
            a = min(int(x), m - 1)
            b = min(int(y), m - 1)
            c = min(int(z), m - 1)
            along_x = spline_weights(x - a)
            along_y = spline_weights(y - b)
            along_z = spline_weights(z - c)
            total = 0.0
            for p in range(4):
                for q in range(4):
                    row = table[a + p, b + q]
                    part = (
                        along_z[0] * row[c]
                        + along_z[1] * row[c + 1]
                        + along_z[2] * row[c + 2]
                        + along_z[3] * row[c + 3]
                    )
                    total += along_x[p] * along_y[q] * part
            value[i] = total
