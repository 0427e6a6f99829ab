"""Compiled search for triangles of one surface that pass through each other."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._collapse_kernels import between
from gradedesign.geometry.triangles._tree_kernels import DEPTH, LEAF, next_leaf


@njit(cache=True, nogil=True)
def _pierces(vertices, p, q, a, b, c, margin):
    """Whether the segment pq goes through the triangle abc, clear of both ends and all sides."""
    ux, uy, uz = between(vertices, a, b)
    vx, vy, vz = between(vertices, a, c)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = np.sqrt(nx * nx + ny * ny + nz * nz)
    if area2 <= 0.0:
        return False
    px, py, pz = between(vertices, a, p)
    qx, qy, qz = between(vertices, a, q)
    dp = (px * nx + py * ny + pz * nz) / area2
    dq = (qx * nx + qy * ny + qz * nz) / area2
    if not ((dp > margin and dq < -margin) or (dp < -margin and dq > margin)):
        return False
    s = dp / (dp - dq)
    x, y, z = px + s * (qx - px), py + s * (qy - py), pz + s * (qz - pz)
    # Twice the signed areas over each side, along the normal; over its length, distances.
    nx, ny, nz = nx / area2, ny / area2, nz / area2
    ab = nx * (uy * z - uz * y) + ny * (uz * x - ux * z) + nz * (ux * y - uy * x)
    ca = -(nx * (vy * z - vz * y) + ny * (vz * x - vx * z) + nz * (vx * y - vy * x))
    bc = area2 - ab - ca
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    return (
        ab > margin * np.sqrt(ux * ux + uy * uy + uz * uz)
        and ca > margin * np.sqrt(vx * vx + vy * vy + vz * vz)
        and bc > margin * np.sqrt(wx * wx + wy * wy + wz * wz)
    )


@njit(cache=True, nogil=True)
def _cross(vertices, faces, i, j, margin):
    """Whether two triangles pass through each other; neighbours across an edge never do."""
    common, at_i, at_j = 0, 0, 0
    for k in range(3):
        for m in range(3):
            if faces[i, k] == faces[j, m]:
                common += 1
                at_i, at_j = k, m
    if common >= 2:
        return False
    for k in range(3):
        m = (k + 1) % 3
        if (common == 0 or (at_i not in (k, m))) and _pierces(
            vertices, faces[i, k], faces[i, m], faces[j, 0], faces[j, 1], faces[j, 2], margin
        ):
            return True
        if (common == 0 or (at_j not in (k, m))) and _pierces(
            vertices, faces[j, k], faces[j, m], faces[i, 0], faces[i, 1], faces[i, 2], margin
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _bound(tri, s, own):
    """Fill a triangle's box, unit normal and offset along it, (10,); zero for one without area."""
    for a in range(3):
        p, b, c = tri[s, a], tri[s, 3 + a], tri[s, 6 + a]
        own[a], own[3 + a] = p + min(0.0, b, c), p + max(0.0, b, c)
    ux, uy, uz = tri[s, 3], tri[s, 4], tri[s, 5]
    vx, vy, vz = tri[s, 6], tri[s, 7], tri[s, 8]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = np.sqrt(nx * nx + ny * ny + nz * nz)
    scale = 1.0 / area2 if area2 > 0.0 else 0.0
    own[6], own[7], own[8] = nx * scale, ny * scale, nz * scale
    own[9] = own[6] * tri[s, 0] + own[7] * tri[s, 1] + own[8] * tri[s, 2]


@njit(cache=True, nogil=True)
def _apart(one, other):
    """Whether two boxes (6,) have no point in common."""
    return (
        one[0] > other[3] or one[3] < other[0] or one[1] > other[4] or one[4] < other[1]
        or one[2] > other[5] or one[5] < other[2]
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _cuts(tri, s, own, thin):
    """Whether a triangle lies on both sides of another's plane."""
    middle = own[6] * tri[s, 0] + own[7] * tri[s, 1] + own[8] * tri[s, 2] - own[9]
    u = own[6] * tri[s, 3] + own[7] * tri[s, 4] + own[8] * tri[s, 5]
    v = own[6] * tri[s, 6] + own[7] * tri[s, 7] + own[8] * tri[s, 8]
    return middle + min(0.0, u, v) < -thin and middle + max(0.0, u, v) > thin


@njit(cache=True, nogil=True)
def find_crossed(
    begin, end, vertices, faces, tri, box, right, first, count, order, leaves, margin, crossed
):
    """Fill, for every triangle, one of higher number that passes through it, or -1.

    The triangles of leaves begin to end are compared with those of the leaves that these meet.
    """
    thin = 1e-3 * margin
    stack, own, other = np.zeros(DEPTH, dtype=np.int64), np.zeros((LEAF, 10)), np.zeros(10)
    for m in range(begin, end):
        here = leaves[m]
        for k in range(count[here]):
            _bound(tri, first[here] + k, own[k])
        low, high = box[here, :3], box[here, 3:]
        stack[0], depth = 0, 1
        while depth > 0:
            leaf, depth = next_leaf(box, right, low, high, stack, depth)
            if leaf < 0:
                break
            for s in range(first[leaf], first[leaf] + count[leaf]):
                for a in range(3):
                    p, b, c = tri[s, a], tri[s, 3 + a], tri[s, 6 + a]
                    other[a], other[3 + a] = p + min(0.0, b, c), p + max(0.0, b, c)
                if _apart(other, box[here]):
                    continue
                j = order[s]
                for k in range(count[here]):
                    i = order[first[here] + k]
                    if j <= i or crossed[i] >= 0 or _apart(other, own[k]):
                        continue
                    if _cuts(tri, s, own[k], thin) and _cross(vertices, faces, i, j, margin):
                        crossed[i] = j
