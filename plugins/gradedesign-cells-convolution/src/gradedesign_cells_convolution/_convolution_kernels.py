"""Compiled sum of Gaussian line integrals near each point."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit

from gradedesign.fields import in_cell


@njit(cache=True, nogil=True)
def between(a, b):
    """Return erf(a) - erf(b) for a > b, without cancellation far from 0."""
    if b > 0.0:
        return math.erfc(b) - math.erfc(a)
    if a < 0.0:
        return math.erfc(-a) - math.erfc(-b)
    return math.erf(a) - math.erf(b)


@njit(cache=True, nogil=True)
def foot(x, y, z, k, start, axis, length):
    """Place along segment k, squared distance to its line and to itself."""
    dx = x - start[k, 0]
    dy = y - start[k, 1]
    dz = z - start[k, 2]
    s = dx * axis[k, 0] + dy * axis[k, 1] + dz * axis[k, 2]
    beyond = max(0.0, -s, s - length[k])
    h2 = max(dx * dx + dy * dy + dz * dz - s * s, 0.0)
    return s, h2, h2 + beyond * beyond


@njit(cache=True, nogil=True)
def line_integrals(
    low, high, points, bins, first, member, start, axis, length, sigma, cut_off, value
):
    """Sum over segments of period 1 at a range of points, into value (n,); see `line_convolution`.

    A segment counts unless its squared distance exceeds that of the nearest one by more than
    ``(cut_off sigma)^2``.
    """
    scale = sigma * math.sqrt(0.5 * math.pi)
    inverse = 1.0 / (sigma * math.sqrt(2.0))
    for i in range(low, high):
        x, y, z, place = in_cell(points, i, bins)
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
