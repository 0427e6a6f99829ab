"""Compiled distances to the segments of a periodic graph, and which segments lie near a place."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit

#: Newton's steps at most, more than any case needs, and the error of a radius over the distance at
#: which they end, above rounding. Chosen, not measured.
NEWTON_STEPS, TOLERANCE = 50, 1e-13


# Called instead, cells of struts take 1.6 times as long, of many struts 2.7 times; compiling takes
# as long either way.
@njit(cache=True, nogil=True, inline="always")
def gauge(x, y, z, k, start, axis, length, normals):
    """Distance to segment k: Euclidean without normals, else that of its prism."""
    dx = x - start[k, 0]
    dy = y - start[k, 1]
    dz = z - start[k, 2]
    along = dx * axis[k, 0] + dy * axis[k, 1] + dz * axis[k, 2]
    if normals.shape[1] == 0:
        foot = min(max(along, 0.0), length[k])
        dx -= foot * axis[k, 0]
        dy -= foot * axis[k, 1]
        dz -= foot * axis[k, 2]
        return math.sqrt(dx * dx + dy * dy + dz * dz)
    value = max(0.0, -along, along - length[k])
    for side in range(normals.shape[1]):
        n = normals[k, side]
        value = max(value, n[0] * dx + n[1] * dy + n[2] * dz)
    return value


@njit(cache=True, nogil=True)
def in_cell(points, i, bins):
    """Coordinates of point i of (3, n) in the unit cell, and number of its bin."""
    x = points[0, i] - math.floor(points[0, i])
    y = points[1, i] - math.floor(points[1, i])
    z = points[2, i] - math.floor(points[2, i])
    # A tiny negative coordinate rounds to 1, which is the far side of the last bin.
    a = min(int(x * bins), bins - 1)
    b = min(int(y * bins), bins - 1)
    c = min(int(z * bins), bins - 1)
    return x, y, z, (a * bins + b) * bins + c


@njit(cache=True, nogil=True)
def greatest_gap(bins, start, axis, length, thickness, normals):
    """Largest value, over the centres of the bins, of the least gauge by thickness."""
    gap = 0.0
    for b in range(bins * bins * bins):
        x, y, z = centre(b, bins)
        least = np.inf
        for k in range(len(length)):
            least = min(least, gauge(x, y, z, k, start, axis, length, normals) / thickness[k])
        gap = max(gap, least)
    return gap


@njit(cache=True, nogil=True)
def centre(b, bins):
    """Centre of a bin of the unit cell."""
    step = 1.0 / bins
    return (
        (b // (bins * bins) + 0.5) * step,
        ((b // bins) % bins + 0.5) * step,
        (b % bins + 0.5) * step,
    )


@njit(cache=True, nogil=True)
def fill_nearest(
    bins, split, coarse_first, coarse_member, start, axis, length, thickness, normals, widen,
    first, member,
):  # fmt: skip
    """List, by bin, every segment that may have the least gauge by thickness somewhere in it.

    Or at most ``widen`` times the least, among those listed for the coarse bin in which it lies,
    which has ``split^3`` of them. A gauge changes by at most the distance moved, so within a bin of
    half diagonal h it lies within h of its value at the centre. Returns the number of entries; with
    an empty ``member`` it only counts.
    """
    half = 0.5 * math.sqrt(3.0) / bins
    coarse = bins // split
    value = np.zeros(len(coarse_member))
    total = 0
    for b in range(bins * bins * bins):
        first[b] = total
        x, y, z = centre(b, bins)
        i, j, k = b // (bins * bins), (b // bins) % bins, b % bins
        parent = ((i // split) * coarse + j // split) * coarse + k // split
        least = np.inf
        for entry in range(coarse_first[parent], coarse_first[parent + 1]):
            n = coarse_member[entry]
            value[entry] = gauge(x, y, z, n, start, axis, length, normals)
            least = min(least, (value[entry] + half) / thickness[n])
        for entry in range(coarse_first[parent], coarse_first[parent + 1]):
            n = coarse_member[entry]
            if (value[entry] - half) / thickness[n] <= widen * least:
                if len(member):
                    member[total] = n
                total += 1
    first[bins * bins * bins] = total
    return total


@njit(cache=True, nogil=True)
def fill_within(bins, start, axis, length, reach, first, member):
    """List, by bin, every segment within reach of some point of it; see `fill_nearest`."""
    limit = reach + 0.5 * math.sqrt(3.0) / bins
    normals = np.zeros((len(length), 0, 3))
    total = 0
    for b in range(bins * bins * bins):
        first[b] = total
        x, y, z = centre(b, bins)
        for k in range(len(length)):
            if gauge(x, y, z, k, start, axis, length, normals) <= limit:
                if len(member):
                    member[total] = k
                total += 1
    first[bins * bins * bins] = total
    return total


@njit(cache=True, nogil=True)
def least_gauge(
    low, high, points, bins, first, member, start, axis, length, thickness, normals, value
):
    """Least gauge by thickness at a range of points (3, n) of period 1, into value (n,)."""
    for i in range(low, high):
        x, y, z, place = in_cell(points, i, bins)
        least = np.inf
        for entry in range(first[place], first[place + 1]):
            k = member[entry]
            least = min(least, gauge(x, y, z, k, start, axis, length, normals) / thickness[k])
        value[i] = least


@njit(cache=True, nogil=True)
def filleted_distance(
    low, high, points, bins, first, member, start, axis, length, fillet, most, value
):
    """Radius of filleted struts whose surface passes through a range of points of period 1.

    Into value (n,); see `gradedesign.geometry.fields.segment_distance`. ``most`` is the number of
    segments of the fullest bin.
    """
    round_struts = np.zeros((0, 0, 3))
    near = np.zeros(most)
    for i in range(low, high):
        x, y, z, place = in_cell(points, i, bins)
        near_count = first[place + 1] - first[place]
        least = np.inf
        for entry in range(near_count):
            k = member[first[place] + entry]
            near[entry] = gauge(x, y, z, k, start, axis, length, round_struts)
            least = min(least, near[entry])
        value[i] = filleted(near[:near_count], least, fillet)


@njit(cache=True, nogil=True)
def filleted(distances, least, fillet):
    """Root t of ``sqrt(sum max((1 + f) t - d, 0)^2) = f t``, at most the least distance.

    The left side less the right one is convex in t and not negative at the least distance: Newton's
    method falls to its greater root from there.
    """
    t = least
    for _ in range(NEWTON_STEPS):
        square = 0.0
        slope = 0.0
        for d in distances:
            inside = (1.0 + fillet) * t - d
            if inside > 0.0:
                square += inside * inside
                slope += inside
        length = math.sqrt(square)
        excess = length - fillet * t
        if excess <= TOLERANCE * least:
            break
        t -= excess / ((1.0 + fillet) * slope / length - fillet)
    return t
