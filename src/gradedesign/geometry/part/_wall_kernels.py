"""Compiled growth of a cylindrical or conical wall from facet to facet."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def _lies(corners, normal, wall, tolerance, widest):
    """Whether a facet has its corners on a wall and is narrow around it, and how it faces out."""
    axis, centre, radius, rise = wall[:3], wall[3:6], wall[6], wall[7]
    slant = np.sqrt(1.0 + rise * rise)
    outward, distance = np.zeros((3, 3)), np.zeros(3)
    for k in range(3):
        along = 0.0
        for c in range(3):
            along += (corners[k, c] - centre[c]) * axis[c]
        for c in range(3):
            outward[k, c] = corners[k, c] - centre[c] - along * axis[c]
            distance[k] += outward[k, c] ** 2
        distance[k] = np.sqrt(distance[k])
        here = radius + rise * along
        if abs(distance[k] - here) > tolerance * slant or here < -tolerance:
            return False, False, 0.0
    narrow, apex = True, 2.0 * tolerance if rise != 0.0 else -1.0
    for k in range(3):
        # Of two corners the cosine of the angle between them around the axis; an apex lies in all
        # directions.
        if distance[k] > apex and distance[k - 1] > apex:
            cosine = 0.0
            for c in range(3):
                cosine += outward[k, c] * outward[k - 1, c]
            narrow &= cosine >= widest * distance[k] * distance[k - 1]
    middle = (outward[0] + outward[1] + outward[2]) / (3.0 * radius)
    if rise != 0.0:
        middle /= max(np.sqrt((middle**2).sum()), 1e-300)
        middle = middle / slant - axis * (rise / slant)
    return True, narrow, (middle * normal).sum()


@njit(cache=True, nogil=True)
def wall_facets(starts, beside, corners, normals, areas, taken, facets, wall, limits):
    """Facets of a wall that hang together with most of the given ones that lie on it.

    Returns their numbers, in no order, and whether they face out of the wall (1) or into it (-1);
    no numbers if fewer than the least of the given ones lie on it.

    Parameters
    ----------
    starts, beside : (m + 1,), (k,) int64 arrays
        Neighbours of facet f: ``beside[starts[f] : starts[f + 1]]``.
    corners, normals, areas : (m, 3, 3), (m, 3), (m,) arrays
    taken : (m,) bool array
        Facets of other faces.
    facets : (n,) int64 array
    wall : (8,) array
        Unit axis, a point of it, the radius there, mm, and its rise along the axis.
    limits : (4,) array
        Largest distance of a corner, mm; cosine of the widest facet around the axis; cosine by
        which a facet faces out or in at least; number of given facets that lie on it at least.
    """
    tolerance, widest, least_facing = limits[0], limits[1], limits[2]
    sense = 0.0
    for f in facets:
        close, _, facing = _lies(corners[f], normals[f], wall, tolerance, widest)
        if close:
            sense += facing * areas[f]
    sense = np.sign(sense)
    own = np.zeros(len(areas), dtype=np.bool_)
    count = 0
    for f in facets:
        close, narrow, facing = _lies(corners[f], normals[f], wall, tolerance, widest)
        own[f] = close and narrow and sense * facing > least_facing and not taken[f]
        count += own[f]
    best = np.zeros(0, dtype=np.int64)
    if count < limits[3]:
        return best, sense
    seen = np.zeros(len(areas), dtype=np.bool_)
    queue = np.zeros(len(areas), dtype=np.int64)
    left, most = count, 0
    for start in facets:
        if seen[start] or not own[start]:
            continue
        seen[start] = True
        queue[0] = start
        first, last, held = 0, 1, 0
        while first < last:
            f = queue[first]
            first += 1
            held += own[f]
            for n in beside[starts[f] : starts[f + 1]]:
                if seen[n] or taken[n]:
                    continue
                close, narrow, facing = _lies(corners[n], normals[n], wall, tolerance, widest)
                if close and narrow and sense * facing > least_facing:
                    seen[n] = True
                    queue[last] = n
                    last += 1
        left -= held
        if held > most:
            most, best = held, queue[:last].copy()
        if most >= left:
            break
    return best, sense
