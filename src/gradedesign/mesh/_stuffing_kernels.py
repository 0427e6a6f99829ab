"""Compiled passes of isosurface stuffing over the grid: cuts, warping, numbering.

Layout. A grid of ``X, Y, Z`` corners holds corner (i, j, k) at index ``2 ((i Y + j) Z + k)`` and
the centre of the cube above it at that index plus one, so every neighbour is a constant step
away. The outermost corners and centres are outside the solid (the caller checks), therefore no
pass needs a bounds test. Every pass runs in layers of i: two rounds, count and fill, give the
same numbering for any number of threads.

An edge belongs to one of its ends: edges along x, y, z (directions 0, 1, 2) to the lower end,
the eight edges between a centre and its cube's corners (3 + dx + 2 dy + 4 dz) to the centre.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

#: Length of long and short lattice edges over h, and the share of an edge within which a cut
#: pulls its end onto the surface (Labelle & Shewchuk 2007, table 1, the safest pair).
LONG, SHORT = 1.0, 0.8660254037844386
ALPHA_LONG, ALPHA_SHORT = 0.24999, 0.41189


@njit(cache=True)
def _bits(x):
    """Count the set bits of an 11-bit mask."""
    x = x - ((x >> 1) & 0x555)
    x = (x & 0x333) + ((x >> 2) & 0x333)
    x = (x & 0x0F) + ((x >> 4) & 0x0F) + (x >> 8)
    return x


@njit(cache=True)
def cut_index(owner, direction, mask, start):
    """Index of the cut on an edge, from its owner and direction."""
    return start[owner] + _bits(np.int64(mask[owner]) & ((1 << direction) - 1))


@njit(cache=True)
def edge_cut(v, d, offsets, mask, start):
    """Cut on the edge from node v to its neighbour d (0..13), and whether v owns the edge."""
    kind = v & 1
    u = v + offsets[kind, d]
    if d < 6:
        if d & 1:
            return cut_index(v, d >> 1, mask, start), True
        return cut_index(u, d >> 1, mask, start), False
    if kind == 1:
        return cut_index(v, d - 3, mask, start), True
    return cut_index(u, 16 - d, mask, start), False


@njit(cache=True)
def node_position(v, Y, Z, lower, h, out):
    """Lattice position of a node, mm, written to out."""
    cell = v >> 1
    half = 0.5 * (v & 1)
    out[0] = lower[0] + h * (cell // (Y * Z) + half)
    out[1] = lower[1] + h * (cell // Z % Y + half)
    out[2] = lower[2] + h * (cell % Z + half)


@njit(cache=True)
def _cut_position(owner, direction, t, Y, Z, lower, h, out):
    """Write the position of a cut at share t of its edge, mm."""
    node_position(owner, Y, Z, lower, h, out)
    if direction < 3:
        out[direction] += t * h
    else:
        q = direction - 3
        for axis in range(3):
            out[axis] += t * h * (((q >> axis) & 1) - 0.5)


@njit(cache=True, parallel=True)
def signs_of(values, sign):
    """Sign of every value: -1 inside, 0 on the surface, 1 outside."""
    for v in prange(len(values)):
        sign[v] = (values[v] > 0.0) - (values[v] < 0.0)


@njit(cache=True, parallel=True, nogil=True)
def mark_cuts(sign, X, Y, Z, ahead, mask, counts):
    """Set the mask of cut edges of every node and count them by layer."""
    for i in prange(X - 1):
        n = 0
        for j in range(Y - 1):
            for k in range(Z - 1):
                for kind in range(2):
                    v = 2 * ((i * Y + j) * Z + k) + kind
                    s = sign[v]
                    if s == 0:
                        continue
                    m = 0
                    for d in range(3 + 8 * kind):
                        if sign[v + ahead[kind, d]] * s < 0:
                            m |= 1 << d
                            n += 1
                    mask[v] = m
        counts[i] = n


@njit(cache=True, parallel=True, nogil=True)
def list_cuts(values, mask, X, Y, Z, ahead, first, start, owner, direction, share):
    """Fill the list of cut edges; shares by linear interpolation from the owner."""
    for i in prange(X - 1):
        n = first[i]
        for j in range(Y - 1):
            for k in range(Z - 1):
                for kind in range(2):
                    v = 2 * ((i * Y + j) * Z + k) + kind
                    m = mask[v]
                    if m == 0:
                        continue
                    start[v] = n
                    for d in range(3 + 8 * kind):
                        if (m >> d) & 1:
                            owner[n] = v
                            direction[n] = d
                            share[n] = values[v] / (values[v] - values[v + ahead[kind, d]])
                            n += 1


@njit(cache=True, parallel=True, nogil=True)
def cut_points(owner, direction, share, Y, Z, lower, h, points):
    """Positions of cuts as (3, n) points, mm."""
    for c in prange(len(owner)):
        _cut_position(owner[c], direction[c], share[c], Y, Z, lower, h, points[:, c])


@njit(cache=True, parallel=True, nogil=True)
def tighten(share, value, near, far, near_value, far_value):
    """One regula falsi step on every cut, inside its bracket [near, far]."""
    for c in prange(len(share)):
        f = value[c]
        if f == 0.0:
            continue
        if (f < 0.0) == (near_value[c] < 0.0):
            near[c] = share[c]
            near_value[c] = f
        else:
            far[c] = share[c]
            far_value[c] = f
        step = near_value[c] / (near_value[c] - far_value[c])
        share[c] = near[c] + (far[c] - near[c]) * step


@njit(cache=True, parallel=True, nogil=True)
def warp_nodes(kind, parity, sign, mask, start, share, X, Y, Z, offsets, warp):
    """Pull nodes of one colour onto the nearest cut that is too close to them.

    No two nodes of a colour share an edge, so that running a colour in parallel equals running
    it one by one, which the angle bounds of the method assume.
    """
    for i in prange(1, X - 1 - kind):
        for j in range(1, Y - 1 - kind):
            for k in range(1 + (i + j + 1 + parity) % 2, Z - 1 - kind, 2):
                v = 2 * ((i * Y + j) * Z + k) + kind
                s = sign[v]
                if s == 0:
                    continue
                best = np.inf
                for d in range(14):
                    if sign[v + offsets[kind, d]] * s >= 0:
                        continue
                    c, owned = edge_cut(v, d, offsets, mask, start)
                    part = share[c] if owned else 1.0 - share[c]
                    length = LONG if d < 6 else SHORT
                    alpha = ALPHA_LONG if d < 6 else ALPHA_SHORT
                    if part < alpha and part * length < best:
                        best = part * length
                        warp[v] = d
                if best < np.inf:
                    sign[v] = 0


@njit(cache=True)
def _outer(v, X, Y, Z):
    """Whether a node lies on the outermost layer, which is never warped."""
    cell = v >> 1
    i, j, k = cell // (Y * Z), cell // Z % Y, cell % Z
    last = 1 + (v & 1)
    return min(i, j, k) == 0 or i >= X - last or j >= Y - last or k >= Z - last


@njit(cache=True, parallel=True, nogil=True)
def count_outer_violations(owner, direction, share, X, Y, Z, ahead):
    """Cuts so close to an outermost node that it would have to move."""
    n = 0
    for c in prange(len(owner)):
        v = np.int64(owner[c])
        alpha = ALPHA_LONG if direction[c] < 3 else ALPHA_SHORT
        if share[c] < alpha:
            n += _outer(v, X, Y, Z)
        elif share[c] > 1.0 - alpha:
            n += _outer(v + ahead[v & 1, direction[c]], X, Y, Z)
    return n


@njit(cache=True)
def _used(v, sign, offsets):
    """Whether a node is a vertex of the mesh: inside, or on the surface beside an inside node."""
    if sign[v] < 0:
        return True
    if sign[v] > 0:
        return False
    kind = v & 1
    least = 0
    for d in range(14):
        least = min(least, sign[v + offsets[kind, d]])
    return least < 0


@njit(cache=True, parallel=True, nogil=True)
def number_vertices(
    fill, sign, mask, start, X, Y, Z, ahead, offsets, first, node_vertex, cut_vertex
):
    """Number the vertices of the mesh by layer, or count them (then first receives the counts)."""
    for i in prange(X - 1):
        n = first[i] if fill else 0
        for j in range(Y - 1):
            for k in range(Z - 1):
                for kind in range(2):
                    v = 2 * ((i * Y + j) * Z + k) + kind
                    s = sign[v]
                    if s <= 0 and _used(v, sign, offsets):
                        if fill:
                            node_vertex[v] = n
                        n += 1
                    m = mask[v]
                    if m == 0 or s == 0:
                        continue
                    c = start[v]
                    for d in range(3 + 8 * kind):
                        if (m >> d) & 1:
                            if sign[v + ahead[kind, d]] != 0:
                                if fill:
                                    cut_vertex[c] = n
                                n += 1
                            c += 1
        if not fill:
            first[i] = n


@njit(cache=True, parallel=True, nogil=True)
def place_vertices(
    node_vertex,
    cut_vertex,
    warp,
    mask,
    start,
    owner,
    direction,
    share,
    Y,
    Z,
    offsets,
    lower,
    h,
    points,
):
    """Positions of all vertices, (n, 3), mm."""
    for v in prange(len(node_vertex)):
        n = node_vertex[v]
        if n < 0:
            continue
        if warp[v] < 0:
            node_position(v, Y, Z, lower, h, points[n])
        else:
            c, _ = edge_cut(v, warp[v], offsets, mask, start)
            _cut_position(owner[c], direction[c], share[c], Y, Z, lower, h, points[n])
    for c in prange(len(cut_vertex)):
        if cut_vertex[c] >= 0:
            _cut_position(owner[c], direction[c], share[c], Y, Z, lower, h, points[cut_vertex[c]])
