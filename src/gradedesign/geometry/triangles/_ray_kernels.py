"""Compiled rays through a tree of triangles: where they first pass through one."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._tree_kernels import DEPTH

#: Shares of a triangle beyond its edges that still count as it: a ray through an edge must hit.
EDGE = 1e-9


@njit(cache=True, nogil=True)
def _entry(box, node, o, d, most):
    """Length at which a ray enters a node's box; infinite without that, or beyond ``most``."""
    near, far = 0.0, most
    for a in range(3):
        low, high = box[node, a], box[node, 3 + a]
        if d[a] == 0.0:
            if o[a] < low or o[a] > high:
                return np.inf
            continue
        first, last = (low - o[a]) / d[a], (high - o[a]) / d[a]
        near, far = max(near, min(first, last)), min(far, max(first, last))
    return near if near <= far * (1.0 + 1e-12) else np.inf


@njit(cache=True, nogil=True)
def _meets(tri, s, o, d, way):
    """Length to where a ray passes through a triangle; infinite where it does not.

    With ``way`` 1 only along its normal, out of the solid, with -1 only into it; 0 is both. Moeller
    & Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    """
    ux, uy, uz = tri[s, 3], tri[s, 4], tri[s, 5]
    vx, vy, vz = tri[s, 6], tri[s, 7], tri[s, 8]
    px, py, pz = d[1] * vz - d[2] * vy, d[2] * vx - d[0] * vz, d[0] * vy - d[1] * vx
    det = ux * px + uy * py + uz * pz
    if det == 0.0 or det * way > 0.0:
        return np.inf
    tx, ty, tz = o[0] - tri[s, 0], o[1] - tri[s, 1], o[2] - tri[s, 2]
    v = (tx * px + ty * py + tz * pz) / det
    if v < -EDGE or v > 1.0 + EDGE:
        return np.inf
    qx, qy, qz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
    w = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if w < -EDGE or v + w > 1.0 + EDGE:
        return np.inf
    length = (vx * qx + vy * qy + vz * qz) / det
    return length if length >= 0.0 else np.inf


@njit(cache=True, nogil=True)
def find_lengths(low, high, tri, box, right, first, count, origins, directions, way, lengths):
    """Fill the lengths of rays low to high, (3, n), to the first triangle they pass through."""
    stack, far = np.zeros(DEPTH, dtype=np.int64), np.zeros(DEPTH)
    for i in range(low, high):
        o = (origins[0, i], origins[1, i], origins[2, i])
        d = (directions[0, i], directions[1, i], directions[2, i])
        best = np.inf
        stack[0], far[0], depth = 0, _entry(box, 0, o, d, best), 1
        while depth > 0:
            depth -= 1
            node, entry = stack[depth], far[depth]
            while right[node] >= 0 and entry <= best and entry < np.inf:
                near, other = node + 1, right[node]
                entry, beyond = _entry(box, near, o, d, best), _entry(box, other, o, d, best)
                if beyond < entry:
                    near, other, entry, beyond = other, near, beyond, entry
                if beyond < np.inf:
                    stack[depth], far[depth] = other, beyond
                    depth += 1
                node = near
            if entry <= best and entry < np.inf:
                for s in range(first[node], first[node] + count[node]):
                    best = min(best, _meets(tri, s, o, d, way))
        lengths[i] = best
