"""Compiled collapse of edges of closed triangle surfaces."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Triangles round a vertex that are looked at; a vertex with more keeps its edges.
MOST = 64
#: Cosine of the angle by which a triangle may turn at most.
LEAST_COSINE = 0.2


@njit(cache=True, nogil=True)
def mark_short(vertices, faces, short2, marked):
    """Mark the ends of edges with a squared length below ``short2``; returns their number."""
    count = 0
    for f in range(len(faces)):
        for c in range(3):
            a, b = faces[f, c], faces[f, (c + 1) % 3]
            if a > b:
                continue
            d = 0.0
            for axis in range(3):
                d += (vertices[a, axis] - vertices[b, axis]) ** 2
            if d < short2:
                marked[a] = True
                marked[b] = True
                count += 1
    return count


@njit(cache=True, nogil=True)
def stars(faces, marked):
    """Triangles round the marked vertices: first (n + 1,), users (k,)."""
    first = np.zeros(len(marked) + 1, dtype=np.int64)
    for f in range(len(faces)):
        for c in range(3):
            if marked[faces[f, c]]:
                first[faces[f, c] + 1] += 1
    for v in range(len(marked)):
        first[v + 1] += first[v]
    users = np.zeros(first[-1], dtype=np.int32)
    fill = first[:-1].copy()
    for f in range(len(faces)):
        for c in range(3):
            v = faces[f, c]
            if marked[v]:
                users[fill[v]] = f
                fill[v] += 1
    return first, users


@njit(cache=True, nogil=True)
def ring_of(faces, first, users, v, ring):
    """Write the vertices that follow ``v`` in its triangles; returns their number."""
    count = first[v + 1] - first[v]
    for n in range(count):
        f = users[first[v] + n]
        for c in range(3):
            if faces[f, c] == v:
                ring[n] = faces[f, (c + 1) % 3]
    return count


@njit(cache=True, nogil=True)
def between(vertices, p, q):
    """Vector from one vertex to another."""
    return (
        vertices[q, 0] - vertices[p, 0],
        vertices[q, 1] - vertices[p, 1],
        vertices[q, 2] - vertices[p, 2],
    )


@njit(cache=True, nogil=True)
def others(faces, f, v):
    """The two vertices that follow ``v`` in triangle f."""
    c = 0
    while faces[f, c] != v:
        c += 1
    return faces[f, (c + 1) % 3], faces[f, (c + 2) % 3]


@njit(cache=True, nogil=True)
def stays_manifold(ring_a, m, ring_b, n):
    """Whether the edge between two vertices may collapse, by their rings: the link condition."""
    common = 0
    for i in range(m):
        for j in range(n):
            common += ring_a[i] == ring_b[j]
    return common == 2 and not (m == 3 and n == 3)  # nothing is left of a tetrahedron


@njit(cache=True, nogil=True)
def move(faces, first, users, gone, kept):
    """Move a vertex onto another; triangles that vanish become -1."""
    for n in range(first[gone], first[gone + 1]):
        f = users[n]
        if faces[f, 0] == kept or faces[f, 1] == kept or faces[f, 2] == kept:
            faces[f] = -1
            continue
        for c in range(3):
            if faces[f, c] == gone:
                faces[f, c] = kept


@njit(cache=True, nogil=True)
def _cost(vertices, faces, first, users, gone, kept):
    """Distance of ``kept`` from the planes round ``gone``; infinite where a triangle would turn."""
    worst = 0.0
    for n in range(first[gone], first[gone + 1]):
        p, q = others(faces, users[n], gone)
        ux, uy, uz = between(vertices, p, q)
        ax, ay, az = between(vertices, p, gone)
        bx, by, bz = between(vertices, p, kept)
        x, y, z = uy * az - uz * ay, uz * ax - ux * az, ux * ay - uy * ax
        size = np.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            worst = max(worst, abs(x * bx + y * by + z * bz) / size)
        if p == kept or q == kept:
            continue
        s, t, w = uy * bz - uz * by, uz * bx - ux * bz, ux * by - uy * bx
        other = np.sqrt(s * s + t * t + w * w)
        if x * s + y * t + z * w <= LEAST_COSINE * size * other:
            return np.inf
    return worst


@njit(cache=True, nogil=True)
def collapse_short(vertices, faces, short2, first, users, locked):
    """One pass over the short edges, of those that share no neighbours; their number.

    ``faces`` is changed in place; triangles that vanish become ``-1``. ``first`` and ``users``
    are the `stars` of the ends of short edges. Returns the collapsed edges and those put off.
    """
    ring_a, ring_b = np.zeros(MOST, dtype=np.int64), np.zeros(MOST, dtype=np.int64)
    done, put_off = 0, 0
    for f in range(len(faces)):
        for c in range(3):
            a, b = faces[f, c], faces[f, (c + 1) % 3]
            if a < 0 or a > b:
                continue
            d = 0.0
            for axis in range(3):
                d += (vertices[a, axis] - vertices[b, axis]) ** 2
            if not d < short2:
                continue
            if max(first[a + 1] - first[a], first[b + 1] - first[b]) > MOST:
                continue
            if locked[a] or locked[b]:
                put_off += 1
                continue
            m = ring_of(faces, first, users, a, ring_a)
            n = ring_of(faces, first, users, b, ring_b)
            if not stays_manifold(ring_a, m, ring_b, n):
                continue
            free = True
            for i in range(m):
                free = free and not locked[ring_a[i]]
            for j in range(n):
                free = free and not locked[ring_b[j]]
            if not free:
                put_off += 1
                continue
            cost_a = _cost(vertices, faces, first, users, a, b)
            cost_b = _cost(vertices, faces, first, users, b, a)
            if min(cost_a, cost_b) == np.inf:
                continue
            gone, kept = (a, b) if cost_a <= cost_b else (b, a)
            move(faces, first, users, gone, kept)
            for i in range(m):
                locked[ring_a[i]] = True
            for j in range(n):
                locked[ring_b[j]] = True
            locked[a] = True
            locked[b] = True
            done += 1
    return done, put_off


@njit(cache=True, nogil=True)
def number_used(faces, chosen, vertices):
    """New numbers of the vertices that chosen triangles use, in order, and their number."""
    number = np.full(vertices, -1, dtype=np.int32)
    for f in range(len(faces)):
        if chosen[f]:
            for c in range(3):
                number[faces[f, c]] = 0
    count = 0
    for v in range(vertices):
        if number[v] == 0:
            number[v] = count
            count += 1
    return number, count


@njit(cache=True, nogil=True)
def renumber(faces, chosen, number, packed):
    """Fill the chosen triangles in new numbers."""
    row = 0
    for f in range(len(faces)):
        if chosen[f]:
            for c in range(3):
                packed[row, c] = number[faces[f, c]]
            row += 1
