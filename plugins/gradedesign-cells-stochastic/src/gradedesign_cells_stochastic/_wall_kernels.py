"""Compiled distance to the faces of periodic Voronoi cells."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

#: Points per unit of threaded work; fixed, so that results do not depend on the threads.
CHUNK = 4096


@njit(cache=True, parallel=True, nogil=True)
def wall_distance(points, bins, first, member, place, owner, side, toward, reach, value):
    """Distance to the nearest face at points (3, n) of period 1, into value (n,).

    ``member[first[b] : first[b + 1]]`` are the seeds, rows of ``place`` and ``owner``, that may be
    the nearest in bin b; ``side[s] : side[s + 1]`` the faces of seed s, each with a unit normal
    ``toward`` and its distance ``reach`` from the seed.
    """
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
            here = (a * bins + b) * bins + c
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
