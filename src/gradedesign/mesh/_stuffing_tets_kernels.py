"""Compiled stencils of isosurface stuffing: one lattice tetrahedron to at most three (or eight).

After warping a lattice tetrahedron has corners inside (-), on the surface (0) and outside (+), and
every edge from - to + carries a cut. What is kept is a tetrahedron, a pyramid or a prism. Their
quadrilaterals lie in faces of the lattice tetrahedron, and are split by a rule that looks at the
quadrilateral alone (shorter diagonal, ties by number), so both sides of a face agree. Should the
three diagonals of a prism run in a cycle, which no split into three can honour, a point is
added at the centre of the convex prism.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.mesh._stuffing_kernels import cut_index

#: Relative difference of squared diagonals below which they count as equal.
TIE = 1e-9


@njit(cache=True)
def _distance2(points, a, b):
    """Squared distance of two vertices, mm^2."""
    x = points[a, 0] - points[b, 0]
    y = points[a, 1] - points[b, 1]
    z = points[a, 2] - points[b, 2]
    return x * x + y * y + z * z


@njit(cache=True)
def _first_diagonal(points, a, b, cut_a, cut_b):
    """Whether the quadrilateral a, b, cut_b, cut_a is split from a to cut_b."""
    x = _distance2(points, a, cut_b)
    y = _distance2(points, b, cut_a)
    if abs(x - y) <= TIE * (x + y):
        return a < b
    return x < y


@njit(cache=True)
def _cut_between(a, b, SX, SY, mask, start):
    """Index of the cut between lattice nodes a and b."""
    low, high = min(a, b), max(a, b)
    step = high - low
    if (step & 1) == 0:
        direction = 0 if step == SX else (1 if step == SY else 2)
        return cut_index(low, direction, mask, start)
    owner = low if low & 1 else high
    step = a + b - 2 * owner + 1
    direction = 3
    if step >= SX:
        direction += 1
        step -= SX
    if step >= SY:
        direction += 2
        step -= SY
    if step > 0:
        direction += 4
    return cut_index(owner, direction, mask, start)


@njit(cache=True)
def orient(tets, first, last, points):
    """Turn tetrahedra of rows first to last positive; returns six times the least volume."""
    least = np.inf
    for n in range(first, last):
        a, b, c, d = tets[n, 0], tets[n, 1], tets[n, 2], tets[n, 3]
        x0, y0, z0 = points[a, 0], points[a, 1], points[a, 2]
        x1, y1, z1 = points[b, 0] - x0, points[b, 1] - y0, points[b, 2] - z0
        x2, y2, z2 = points[c, 0] - x0, points[c, 1] - y0, points[c, 2] - z0
        x3, y3, z3 = points[d, 0] - x0, points[d, 1] - y0, points[d, 2] - z0
        volume = x1 * (y2 * z3 - z2 * y3) - y1 * (x2 * z3 - z2 * x3) + z1 * (x2 * y3 - y2 * x3)
        if volume < 0.0:
            tets[n, 2], tets[n, 3] = d, c
        least = min(least, abs(volume))
    return least


@njit(cache=True)
def _put(out, n, a, b, c, d):
    """Store a tetrahedron in row n, in any orientation."""
    out[n, 0] = a
    out[n, 1] = b
    out[n, 2] = c
    out[n, 3] = d


@njit(cache=True)
def split_prism(u, w, diagonal, out, n, points, extra):
    """Split the prism u over w, whose side q runs from (u_q, w_q) to (u_q+1, w_q+1).

    Parameters
    ----------
    u, w : (3,) int arrays
        Vertices.
    diagonal : (3,) bool array
        True where side q is split from u_q to w_q+1, False for u_q+1 to w_q.
    out, n : (m, 4) int array, int
        Where tetrahedra go, and the first free row.
    points : (k, 3) array, mm
        Vertices; row ``extra`` receives the added point in the cyclic case.
    extra : int
        Number of the point to add.

    Returns
    -------
    n : int
        The next free row.
    extra : int
        The next free point.
    """
    if diagonal[0] == diagonal[1] and diagonal[1] == diagonal[2]:
        for axis in range(3):
            total = 0.0
            for q in range(3):
                total += points[u[q], axis] + points[w[q], axis]
            points[extra, axis] = total / 6.0
        _put(out, n, extra, u[0], u[1], u[2])
        _put(out, n + 1, extra, w[0], w[1], w[2])
        for q in range(3):
            r = (q + 1) % 3
            if diagonal[q]:
                _put(out, n + 2 + 2 * q, extra, u[q], w[r], u[r])
                _put(out, n + 3 + 2 * q, extra, u[q], w[r], w[q])
            else:
                _put(out, n + 2 + 2 * q, extra, u[r], w[q], u[q])
                _put(out, n + 3 + 2 * q, extra, u[r], w[q], w[r])
        return n + 8, extra + 1
    q = 0
    while not (diagonal[q] and not diagonal[(q + 2) % 3]):
        q += 1
    r, s = (q + 1) % 3, (q + 2) % 3
    _put(out, n, u[q], w[0], w[1], w[2])
    if diagonal[r]:
        _put(out, n + 1, u[q], u[r], w[s], w[r])
        _put(out, n + 2, u[q], u[r], u[s], w[s])
    else:
        _put(out, n + 1, u[q], u[s], w[r], w[s])
        _put(out, n + 2, u[q], u[s], u[r], w[r])
    return n + 3, extra


@njit(cache=True)
def _three_inside(a, cuts, diagonal, points):
    """Set the diagonals of a prism with three corners a inside; whether they run in a cycle."""
    for q in range(3):
        r = (q + 1) % 3
        diagonal[q] = _first_diagonal(points, a[q], a[r], cuts[q], cuts[r])
    return diagonal[0] == diagonal[1] and diagonal[1] == diagonal[2]


@njit(cache=True)
def _two_inside(u, w, diagonal, points):
    """Set the diagonals of a prism with two corners inside, u0 and w0.

    The side u1, u2, w2, w1 lies on the surface and belongs to this tetrahedron alone: its
    diagonal avoids a cycle, and is the shorter one where both do.
    """
    diagonal[0] = _first_diagonal(points, u[0], w[0], u[1], w[1])
    diagonal[2] = not _first_diagonal(points, u[0], w[0], u[2], w[2])
    if diagonal[0] == diagonal[2]:
        diagonal[1] = not diagonal[0]
    else:
        diagonal[1] = _distance2(points, u[1], w[2]) < _distance2(points, u[2], w[1])


@njit(cache=True)
def _emit(ni, no, a, surface, cuts, u, w, diagonal, out, n, points, extra):
    """Write the tetrahedra that fill the solid part of one lattice tetrahedron.

    Vertices: ``a`` inside (ni of them), ``surface``, and ``cuts[p * no + o]`` between inside
    corner p and outside corner o. Returns the next row and the next free point.
    """
    if no == 0 or ni == 1:
        for p in range(4):
            if p < ni:
                u[p] = a[p]
            elif p < ni + no:
                u[p] = cuts[p - ni]
            else:
                u[p] = surface[p - ni - no]
        _put(out, n, u[0], u[1], u[2], u[3])
        return n + 1, extra
    if ni == 2 and no == 1:
        first = _first_diagonal(points, a[0], a[1], cuts[0], cuts[1])
        p, q = (a[0], cuts[1]) if first else (a[1], cuts[0])
        r, s = (a[1], cuts[0]) if first else (a[0], cuts[1])
        _put(out, n, p, q, r, surface[0])
        _put(out, n + 1, p, q, s, surface[0])
        return n + 2, extra
    if ni == 3:
        _three_inside(a, cuts, diagonal, points)
        return split_prism(a, cuts, diagonal, out, n, points, extra)
    u[0], u[1], u[2] = a[0], cuts[0], cuts[1]
    w[0], w[1], w[2] = a[1], cuts[2], cuts[3]
    _two_inside(u, w, diagonal, points)
    return split_prism(u, w, diagonal, out, n, points, extra)


@njit(cache=True)
def _nodes_of(i, j, k, axis, Y, Z, nodes):
    """Write the two centres and the ring of four corners around face +axis of a cube."""
    corner = 2 * ((i * Y + j) * Z + k)
    step = (2 * Y * Z, 2 * Z, 2)
    second, third = step[(axis + 1) % 3], step[(axis + 2) % 3]
    base = corner + step[axis]
    nodes[0] = corner + 1
    nodes[1] = base + 1
    nodes[2] = base
    nodes[3] = base + second
    nodes[4] = base + second + third
    nodes[5] = base + third


@njit(cache=True)
def _sort_corners(nodes, q, sign, inside, outside, surface):
    """Split the corners of tetrahedron q around a face by sign; returns the three counts."""
    ni, no, ns = 0, 0, 0
    for p in range(4):
        v = nodes[p] if p < 2 else nodes[2 + (q + p - 2) % 4]
        s = sign[v]
        if s < 0:
            inside[ni] = v
            ni += 1
        elif s > 0:
            outside[no] = v
            no += 1
        else:
            surface[ns] = v
            ns += 1
    return ni, no, ns


@njit(cache=True)
def _layer(fill, i, sign, mask, start, node_vertex, cut_vertex, Y, Z, n, extra, points, tets):
    """Write, or only count, the tetrahedra of one layer of cubes.

    Returns the next row of tets, the next free point, and six times the least volume written.
    """
    nodes = np.zeros(6, dtype=np.int64)
    inside, outside, surface, cuts, u, w = np.zeros((6, 4), dtype=np.int64)
    diagonal = np.zeros(3, dtype=np.bool_)
    SX, SY = 2 * Y * Z, 2 * Z
    least = np.inf
    for face in range((Y - 1) * (Z - 1) * 3):
        _nodes_of(i, face // 3 // (Z - 1), face // 3 % (Z - 1), face % 3, Y, Z, nodes)
        low = 1
        for q in range(6):
            low = min(low, sign[nodes[q]])
        if low >= 0:
            continue
        for q in range(4):
            ni, no, ns = _sort_corners(nodes, q, sign, inside, outside, surface)
            if ni == 0:
                continue
            if not fill and (ni < 3 or no == 0):
                n += 1 if no == 0 or ni == 1 else no + 1
                continue
            for p in range(ni):
                for o in range(no):
                    c = _cut_between(inside[p], outside[o], SX, SY, mask, start)
                    cuts[p * no + o] = cut_vertex[c]
            for p in range(ni):
                inside[p] = node_vertex[inside[p]]
            for p in range(ns):
                surface[p] = node_vertex[surface[p]]
            if fill:
                row = n
                n, extra = _emit(
                    ni, no, inside, surface, cuts, u, w, diagonal, tets, n, points, extra
                )
                least = min(least, orient(tets, row, n, points))
            else:
                cyclic = _three_inside(inside, cuts, diagonal, points)
                n += 8 if cyclic else 3
                extra += cyclic
    return n, extra, least


@njit(cache=True, parallel=True, nogil=True)
def make_tets(
    fill, sign, mask, start, node_vertex, cut_vertex, X, Y, Z, points, tets, first, extra, least
):
    """Write all tetrahedra, layer i from row first[i] and point extra[i]; or count both."""
    for i in prange(X - 1):
        n = first[i] if fill else 0
        e = extra[i] if fill else 0
        n, e, least[i] = _layer(
            fill, i, sign, mask, start, node_vertex, cut_vertex, Y, Z, n, e, points, tets
        )
        if not fill:
            first[i] = n
            extra[i] = e
