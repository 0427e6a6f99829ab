"""Compiled removal of vertices of a closed triangle surface within a tolerance."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._closest_kernels import nearest_shares
from gradedesign.geometry.triangles._collapse_kernels import (
    MOST,
    between,
    move,
    others,
    ring_of,
    stays_manifold,
)

#: Cosine of the angle by which a triangle may turn at most.
LEAST_COSINE = 0.5
#: Least height of a triangle over its longest side, unless one round the vertex has less before.
LEAST_HEIGHT = 0.05
#: Samples of the fine surface for which triangles round a vertex stand, at most.
MOST_POINTS = 4096


@njit(cache=True, nogil=True)
def _sample(vertices, fine, p):
    """Vertex p of the fine surface, or the centre of its triangle ``p - len(vertices)``."""
    if p < len(vertices):
        return vertices[p, 0], vertices[p, 1], vertices[p, 2]
    f = p - len(vertices)
    a, b, c = fine[f, 0], fine[f, 1], fine[f, 2]
    return (
        (vertices[a, 0] + vertices[b, 0] + vertices[c, 0]) / 3.0,
        (vertices[a, 1] + vertices[b, 1] + vertices[c, 1]) / 3.0,
        (vertices[a, 2] + vertices[b, 2] + vertices[c, 2]) / 3.0,
    )


@njit(cache=True, nogil=True)
def _distance2(vertices, x, y, z, a, b, c):
    """Squared distance of a point from triangle abc with area (Ericson 2005, section 5.1.5)."""
    px, py, pz = x - vertices[a, 0], y - vertices[a, 1], z - vertices[a, 2]
    bx, by, bz = between(vertices, a, b)
    cx, cy, cz = between(vertices, a, c)
    bb, cc = bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
    bc = bx * cx + by * cy + bz * cz
    d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    v, w, _ = nearest_shares(bb, bc, cc, d1, d2)
    ex, ey, ez = px - v * bx - w * cx, py - v * by - w * cy, pz - v * bz - w * cz
    return ex * ex + ey * ey + ez * ez


@njit(cache=True, nogil=True)
def _shape(vertices, a, b, c):
    """Normal times twice the area, and least height over the longest side."""
    ux, uy, uz = between(vertices, a, b)
    vx, vy, vz = between(vertices, a, c)
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    longest2 = max(
        ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    )
    height = np.sqrt(x * x + y * y + z * z) / longest2 if longest2 > 0.0 else 0.0
    return x, y, z, height


@njit(cache=True, nogil=True)
def _gather(first, users, gone, head, after, points):
    """Write the samples for which the triangles round ``gone`` stand, and ``gone``."""
    points[0], count = gone, 1
    for n in range(first[gone], first[gone + 1]):
        p = head[users[n]]
        while p >= 0:
            if count == len(points):
                return -1
            points[count] = p
            count += 1
            p = after[p]
    return count


@njit(cache=True, nogil=True)
def _is_shaped(vertices, faces, first, users, gone, kept, least):
    """Whether moving ``gone`` to ``kept`` turns no triangle and makes none too flat."""
    for n in range(first[gone], first[gone + 1]):
        p, q = others(faces, users[n], gone)
        if p == kept or q == kept:
            continue
        x, y, z, _ = _shape(vertices, gone, p, q)
        s, t, w, height = _shape(vertices, kept, p, q)
        if height < least:
            return False
        size2 = (x * x + y * y + z * z) * (s * s + t * t + w * w)
        if x * s + y * t + z * w <= LEAST_COSINE * np.sqrt(size2):
            return False
    return True


@njit(cache=True, nogil=True)
def _nearest(vertices, fine, faces, first, users, gone, kept, sample, enough):
    """Squared distance of a sample from the triangles after the move, and where in ``users``.

    Of the first that is near enough, else of the nearest.
    """
    x, y, z = _sample(vertices, fine, sample)
    best, where = np.inf, -1
    for n in range(first[gone], first[gone + 1]):
        p, q = others(faces, users[n], gone)
        if p == kept or q == kept:
            continue
        d = _distance2(vertices, x, y, z, kept, p, q)
        if d < best:
            best, where = d, n
            if best <= enough:
                break
    return best, where


@njit(cache=True, nogil=True)
def _best_move(
    vertices, fine, faces, first, users, gone, ring, m, other, points, count, tolerance2
):
    """Neighbour onto which a vertex may move with the least distance, or -1."""
    least = LEAST_HEIGHT
    for n in range(first[gone], first[gone + 1]):
        f = users[n]
        least = min(least, _shape(vertices, faces[f, 0], faces[f, 1], faces[f, 2])[3])
    best, target = np.inf, -1
    for i in range(m):
        kept = ring[i]
        k = first[kept + 1] - first[kept]
        if k + m - 4 > MOST:
            continue
        ring_of(faces, first, users, kept, other)
        if not stays_manifold(ring, m, other, k):
            continue
        if not _is_shaped(vertices, faces, first, users, gone, kept, least):
            continue
        far, _ = _nearest(vertices, fine, faces, first, users, gone, kept, gone, 0.0)
        if far > tolerance2:
            continue
        x, y, z = between(vertices, gone, kept)
        cost = far / tolerance2 + 1e-3 * (x * x + y * y + z * z) / tolerance2
        if cost >= best:
            continue
        fits = True
        for p in range(1, count):
            d, _ = _nearest(vertices, fine, faces, first, users, gone, kept, points[p], tolerance2)
            if d > tolerance2:
                fits = False
                break
        if fits:
            best, target = cost, kept
    return target


@njit(cache=True, nogil=True)
def remove_vertices(
    vertices, fine, faces, first, users, locked, open_ends, head, after, tolerance2
):
    """One pass over the vertices, of which those go that share no neighbours; their number.

    Parameters
    ----------
    vertices : (n, 3) array
    fine : (k, 3) int array
        Triangles at the beginning. Their vertices and centres are the samples, numbered so.
    faces : (m, 3) int32 array
        Changed in place; triangles that vanish become -1.
    first, users : stars of all vertices
    locked : (n,) bool array
        False at first; True round what changed in this pass.
    open_ends : (n,) bool array
        Vertices that are tried; False for those that cannot go as long as nothing round them
        changes.
    head : (m,), after : (n + k,) int32 arrays
        Samples for which each triangle stands, as linked lists that end in -1.
    tolerance2 : float
        Square of the farthest that a sample may be from its triangle.
    """
    ring, other = np.zeros(MOST, dtype=np.int64), np.zeros(MOST, dtype=np.int64)
    points = np.zeros(MOST_POINTS, dtype=np.int64)
    done = 0
    for gone in range(len(vertices)):
        m = first[gone + 1] - first[gone]
        if not open_ends[gone] or locked[gone] or m == 0 or m > MOST:
            continue
        ring_of(faces, first, users, gone, ring)
        free = True
        for i in range(m):
            free = free and not locked[ring[i]] and first[ring[i] + 1] - first[ring[i]] <= MOST
        if not free:
            continue
        count = _gather(first, users, gone, head, after, points)
        kept = -1
        if count > 0:
            kept = _best_move(
                *(vertices, fine, faces, first, users, gone, ring, m, other, points, count),
                tolerance2,
            )
        if kept < 0:
            open_ends[gone] = False
            continue
        for n in range(first[gone], first[gone + 1]):
            head[users[n]] = -1
        for p in range(count):
            _, n = _nearest(vertices, fine, faces, first, users, gone, kept, points[p], 0.0)
            after[points[p]] = head[users[n]]
            head[users[n]] = points[p]
        k = first[kept + 1] - first[kept]
        ring_of(faces, first, users, kept, other)
        move(faces, first, users, gone, kept)
        for i in range(m):
            locked[ring[i]] = True
            open_ends[ring[i]] = True
        for i in range(k):
            locked[other[i]] = True
            open_ends[other[i]] = True
        locked[gone] = True
        done += 1
    return done
