"""Compiled distances to segments of period 1, looked up in fine bins."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

#: Points per unit of threaded work; fixed, so that results do not depend on the threads.
CHUNK = 4096


@njit(cache=True, inline="always")
def square_distance(x, y, z, row):
    """Squared distance to a segment: its start, unit axis (zero for a point) and length."""
    dx = x - row[0]
    dy = y - row[1]
    dz = z - row[2]
    foot = min(max(dx * row[3] + dy * row[4] + dz * row[5], 0.0), row[6])
    dx -= foot * row[3]
    dy -= foot * row[4]
    dz -= foot * row[5]
    return dx * dx + dy * dy + dz * dz


@njit(cache=True)
def refine(coarse, coarse_first, coarse_member, rows, split, first, member):
    """List, by fine bin, every segment that may be the nearest somewhere in it.

    Each coarse bin has ``split^3`` fine ones. A distance changes by at most the distance moved, so
    within a bin of half diagonal h it lies within h of its value at the centre. Returns the number
    of entries and the largest least distance at a centre; an empty ``member`` only counts.
    """
    bins = coarse * split
    half = 0.5 * math.sqrt(3.0) / bins
    value = np.zeros(coarse_member.size)
    total = 0
    widest = 0.0
    for b in range(bins * bins * bins):
        first[b] = total
        i, j, k = b // (bins * bins), (b // bins) % bins, b % bins
        x, y, z = (i + 0.5) / bins, (j + 0.5) / bins, (k + 0.5) / bins
        here = ((i // split) * coarse + j // split) * coarse + k // split
        least = np.inf
        for entry in range(coarse_first[here], coarse_first[here + 1]):
            square = square_distance(x, y, z, rows[coarse_member[entry]])
            value[entry] = math.sqrt(square)
            least = min(least, value[entry])
        widest = max(widest, least)
        for entry in range(coarse_first[here], coarse_first[here + 1]):
            if value[entry] <= least + 2.0 * half:
                if member.size:
                    member[total] = coarse_member[entry]
                total += 1
    first[bins * bins * bins] = total
    return total, widest


@njit(cache=True, parallel=True, nogil=True)
def least_distance(points, bins, first, member, rows, value):
    """Distance to the nearest segment at points (3, n) of period 1, into value (n,)."""
    count = points.shape[1]
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
            least = np.inf
            for entry in range(first[place], first[place + 1]):
                least = min(least, square_distance(x, y, z, rows[member[entry]]))
            value[i] = math.sqrt(least)
