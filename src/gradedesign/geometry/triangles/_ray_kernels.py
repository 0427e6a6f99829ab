"""Compiled rays through a tree of triangles: where they leave the solid."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.geometry.triangles._closest_kernels import CHUNK, DEPTH

#: Shares of a triangle beyond its edges that still count as it: a ray through an edge must hit.
EDGE = 1e-9


@njit(cache=True)
def _enters(box, node, o, d, most):
    """Whether a ray of length ``most`` meets a node's box."""
    near, far = 0.0, most
    for a in range(3):
        low, high = box[node, a], box[node, 3 + a]
        if d[a] == 0.0:
            if o[a] < low or o[a] > high:
                return False
            continue
        first, last = (low - o[a]) / d[a], (high - o[a]) / d[a]
        near, far = max(near, min(first, last)), min(far, max(first, last))
    return near <= far * (1.0 + 1e-12)


@njit(cache=True)
def leaves(a, u, v, o, d):
    """Length to where a ray leaves the solid through a triangle; infinite where it does not.

    The triangle is a corner and two edge vectors from it. Moeller & Trumbore, "Fast, minimum
    storage ray/triangle intersection", 1997.
    """
    ux, uy, uz = u
    vx, vy, vz = v
    px, py, pz = d[1] * vz - d[2] * vy, d[2] * vx - d[0] * vz, d[0] * vy - d[1] * vx
    det = ux * px + uy * py + uz * pz
    if det >= 0.0:  # enters, or grazes
        return np.inf
    tx, ty, tz = o[0] - a[0], o[1] - a[1], o[2] - a[2]
    s = (tx * px + ty * py + tz * pz) / det
    if s < -EDGE or s > 1.0 + EDGE:
        return np.inf
    qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
    t = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if t < -EDGE or s + t > 1.0 + EDGE:
        return np.inf
    length = (vx * qx + vy * qy + vz * qz) / det
    return length if length >= 0.0 else np.inf


@njit(cache=True, parallel=True, nogil=True)
def exit_lengths(tri, box, right, first, count, origins, directions, lengths):
    """Fill the length of every ray, (3, n), from inside to where it first leaves the solid."""
    n = origins.shape[1]
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        stack = np.zeros(DEPTH, dtype=np.int64)
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            o = (origins[0, i], origins[1, i], origins[2, i])
            d = (directions[0, i], directions[1, i], directions[2, i])
            best = np.inf
            stack[0], depth = 0, 1
            while depth > 0:
                depth -= 1
                node = stack[depth]
                if not _enters(box, node, o, d, best):
                    continue
                if right[node] >= 0:
                    stack[depth], stack[depth + 1] = right[node], node + 1
                    depth += 2
                    continue
                for s in range(first[node], first[node] + count[node]):
                    a = tri[s, 0], tri[s, 1], tri[s, 2]
                    u, v = (tri[s, 3], tri[s, 4], tri[s, 5]), (tri[s, 6], tri[s, 7], tri[s, 8])
                    best = min(best, leaves(a, u, v, o, d))
            lengths[i] = best
