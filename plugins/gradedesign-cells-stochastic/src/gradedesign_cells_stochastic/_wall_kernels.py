"""Compiled distance to the faces of periodic Voronoi cells."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.fields import in_cell


@njit(cache=True, nogil=True)
def wall_distance(low, high, points, bins, first, member, place, owner, side, toward, reach, value):
    """Distance to the nearest face at a range of points (3, n) of period 1, into value (n,).

    ``member[first[b] : first[b + 1]]`` are the seeds, rows of ``place`` and ``owner``, that may be
    the nearest in bin b; ``side[s] : side[s + 1]`` the faces of seed s, each with a unit normal
    ``toward`` and its distance ``reach`` from the seed.
    """
    for i in range(low, high):
        x, y, z, here = in_cell(points, i, bins)
        nearest = -1
        square = np.inf
        for entry in range(first[here], first[here + 1]):
            k = member[entry]
            dx = x - place[k, 0]
            dy = y - place[k, 1]
            dz = z - place[k, 2]
            away = dx * dx + dy * dy + dz * dz
            if away < square:
                square = away
                nearest = k
        dx = x - place[nearest, 0]
        dy = y - place[nearest, 1]
        dz = z - place[nearest, 2]
        least = np.inf
        for k in range(side[owner[nearest]], side[owner[nearest] + 1]):
            along = dx * toward[k, 0] + dy * toward[k, 1] + dz * toward[k, 2]
            least = min(least, reach[k] - along)
        # Rounding may put a point on a face beyond it.
        value[i] = max(least, 0.0)
