"""Compiled bounding volume hierarchy over triangles: build and closest point."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

#: Triangles per leaf, points per unit of threaded work (fixed, so that results do not depend on
#: the number of threads), and depth of the traversal stack (a balanced tree of 2**31 leaves).
LEAF, CHUNK, DEPTH = 4, 256, 64
#: Boxes farther than the nearest triangle by no more than this share of rounding are searched too.
_TIED = 1.0 + 1e-12


@njit(cache=True)
def _select(order, key, first, last, middle):
    """Partition order[first:last] so that the smallest keys come before middle."""
    last -= 1
    while first < last:
        pivot = key[order[(first + last) // 2]]
        i, j = first, last
        while i <= j:
            while key[order[i]] < pivot:
                i += 1
            while key[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            last = j
        elif middle >= i:
            first = i
        else:
            return


@njit(cache=True, nogil=True)
def build_tree(corners, centres, order, box, right, first, count):
    """Fill a balanced tree, left child after its parent; returns the number of nodes.

    Parameters
    ----------
    corners : (m, 3, 3) array, mm
    centres : (3, m) array, mm
    order : (m,) int array
        Triangles, sorted by leaf on return.
    box : (k, 6) array, mm
        Lower and upper corner of every node.
    right, first, count : (k,) int arrays
        Right child (-1 in a leaf); the range of ``order`` of a node.
    """
    stack = np.zeros((DEPTH, 3), dtype=np.int64)
    stack[0, 1], stack[0, 2] = 0, len(order)
    stack[0, 0] = -1
    depth, nodes = 1, 0
    while depth > 0:
        depth -= 1
        parent, begin, end = stack[depth]
        node = nodes
        nodes += 1
        if parent >= 0:
            right[parent] = node
        while True:
            first[node], count[node], right[node] = begin, end - begin, -1
            spread, axis = -1.0, 0
            for a in range(3):
                low, high = np.inf, -np.inf
                least, most = np.inf, -np.inf
                for s in range(begin, end):
                    t = order[s]
                    for c in range(3):
                        low = min(low, corners[t, c, a])
                        high = max(high, corners[t, c, a])
                    least = min(least, centres[a, t])
                    most = max(most, centres[a, t])
                box[node, a], box[node, 3 + a] = low, high
                if most - least > spread:
                    spread, axis = most - least, a
            if end - begin <= LEAF:
                break
            middle = (begin + end) // 2
            _select(order, centres[axis], begin, end, middle)
            stack[depth, 0], stack[depth, 1], stack[depth, 2] = node, middle, end
            depth += 1
            end = middle
            node = nodes
            nodes += 1
    return nodes


@njit(cache=True)
def _box_distance2(box, node, x, y, z):
    """Squared distance of a point to a node's box, mm^2."""
    dx = max(box[node, 0] - x, 0.0, x - box[node, 3])
    dy = max(box[node, 1] - y, 0.0, y - box[node, 4])
    dz = max(box[node, 2] - z, 0.0, z - box[node, 5])
    return dx * dx + dy * dy + dz * dz


@njit(cache=True)
def _on_segment(dot, length2):
    """Share of a segment nearest to a point, from its projection; 0 for a segment of no length."""
    if dot <= 0.0 or length2 <= 0.0:
        return 0.0
    return min(dot / length2, 1.0)


@njit(cache=True)
def _flat_nearest(b, c, px, py, pz):
    """Shares (v, w) and feature of the nearest point of a triangle without area: its sides."""
    ends = ((0.0, 0.0, 1.0, 0.0), (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.0))
    best = np.inf
    v, w, feature = 0.0, 0.0, 4
    for e in range(3):
        v0, w0, v1, w1 = ends[e]
        ox, oy, oz = v0 * b[0] + w0 * c[0], v0 * b[1] + w0 * c[1], v0 * b[2] + w0 * c[2]
        ex = v1 * b[0] + w1 * c[0] - ox
        ey = v1 * b[1] + w1 * c[1] - oy
        ez = v1 * b[2] + w1 * c[2] - oz
        s = _on_segment(
            (px - ox) * ex + (py - oy) * ey + (pz - oz) * ez, ex * ex + ey * ey + ez * ez
        )
        d = (px - ox - s * ex) ** 2 + (py - oy - s * ey) ** 2 + (pz - oz - s * ez) ** 2
        if d < best:
            best = d
            v, w = v0 + s * (v1 - v0), w0 + s * (w1 - w0)
            feature = 1 + e if 0.0 < s < 1.0 else 4 + (e + (s > 0.0)) % 3
    return v, w, feature


@njit(cache=True)
def nearest_shares(bb, bc, cc, d1, d2):
    """Shares (v, w) and feature of the nearest point of a triangle with area.

    From the products of its edge vectors b and c with each other and with the point (d1, d2).
    """
    d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        return 0.0, 0.0, 4
    if d3 >= 0.0 and d4 <= d3:
        return 1.0, 0.0, 5
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 1.0, 6
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return d1 / (d1 - d3), 0.0, 1
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 0.0, d2 / (d2 - d6), 3
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 1.0 - w, w, 2
    total = va + vb + vc
    return vb / total, vc / total, 0


@njit(cache=True)
def nearest_on_triangle(tri, flat, slot, x, y, z):
    """Nearest point a + v ab + w ac of a triangle (Ericson 2005, section 5.1.5).

    Returns the squared distance, the shares v and w and the feature: 0 face; 1, 2, 3 edges ab,
    bc, ca; 4, 5, 6 corners a, b, c.
    """
    px, py, pz = x - tri[slot, 0], y - tri[slot, 1], z - tri[slot, 2]
    bx, by, bz = tri[slot, 3], tri[slot, 4], tri[slot, 5]
    cx, cy, cz = tri[slot, 6], tri[slot, 7], tri[slot, 8]
    if flat[slot]:
        v, w, feature = _flat_nearest((bx, by, bz), (cx, cy, cz), px, py, pz)
    else:
        bb, bc, cc = (
            bx * bx + by * by + bz * bz,
            bx * cx + by * cy + bz * cz,
            cx * cx + cy * cy + cz * cz,
        )
        d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
        v, w, feature = nearest_shares(bb, bc, cc, d1, d2)
    ex, ey, ez = px - v * bx - w * cx, py - v * by - w * cy, pz - v * bz - w * cz
    return ex * ex + ey * ey + ez * ez, v, w, feature


@njit(cache=True)
def _search(tri, flat, box, right, first, count, x, y, z, slot, most, stack, far):
    """Nearest triangle to a point, starting from a guess.

    Returns its slot and squared distance; the guess and ``most`` where none is within ``most``.
    """
    best, _, _, _ = nearest_on_triangle(tri, flat, slot, x, y, z)
    best = min(best, most)
    # Triangles that share the nearest corner differ by rounding: all are evaluated, so that
    # the distance does not depend on the guess.
    tied = best * _TIED
    stack[0], far[0], depth = 0, _box_distance2(box, 0, x, y, z), 1
    while depth > 0:
        depth -= 1
        if far[depth] > tied:
            continue
        node = stack[depth]
        while right[node] >= 0:
            a, b = node + 1, right[node]
            da, db = _box_distance2(box, a, x, y, z), _box_distance2(box, b, x, y, z)
            if db < da:
                a, b, da, db = b, a, db, da
            if db <= tied:
                stack[depth], far[depth] = b, db
                depth += 1
            if da > tied:
                break
            node = a
        if right[node] >= 0:
            continue
        for s in range(first[node], first[node] + count[node]):
            d, _, _, _ = nearest_on_triangle(tri, flat, s, x, y, z)
            if d < best:
                best, slot = d, s
                tied = best * _TIED
    return slot, best


@njit(cache=True, parallel=True, nogil=True)
def find_closest(
    tri, flat, box, right, first, count, order, points, distance, triangle, closest, feature
):
    """Closest triangle, point and feature of every point of a (3, n) array."""
    n = points.shape[1]
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        stack = np.zeros(DEPTH, dtype=np.int64)
        far = np.zeros(DEPTH)
        slot = 0
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            x, y, z = points[0, i], points[1, i], points[2, i]
            slot, _ = _search(
                tri, flat, box, right, first, count, x, y, z, slot, np.inf, stack, far
            )
            d, v, w, code = nearest_on_triangle(tri, flat, slot, x, y, z)
            distance[i] = np.sqrt(d)
            triangle[i] = order[slot]
            feature[i] = code
            for a in range(3):
                closest[a, i] = tri[slot, a] + v * tri[slot, 3 + a] + w * tri[slot, 6 + a]


@njit(cache=True, parallel=True, nogil=True)
def find_distance(tri, flat, box, right, first, count, points, reach, distance):
    """Distance of every point of a (3, n) array to the triangles, at most ``reach``."""
    n = points.shape[1]
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        stack = np.zeros(DEPTH, dtype=np.int64)
        far = np.zeros(DEPTH)
        slot = 0
        for i in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            x, y, z = points[0, i], points[1, i], points[2, i]
            slot, best = _search(
                tri, flat, box, right, first, count, x, y, z, slot, reach * reach, stack, far
            )
            distance[i] = min(np.sqrt(best), reach)
