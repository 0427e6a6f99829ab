"""Compiled search for the triangle of a tree that is closest to a point."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._tree_kernels import CHUNK, DEPTH

#: Boxes farther than the nearest triangle by no more than this share of rounding are searched too.
_TIED = 1.0 + 1e-12
#: Bounds that follow from other distances are taken larger by rounding, also at thin triangles.
_LOOSE = 1.0 + 1e-6
#: Points that share a traversal of the tree, those that share its triangles near them, and most of
#: these triangles, 300 kB in two lists: 0.95 microseconds a sample of 2.3 M triangles (`clevis`);
#: 1.06 with 16 points, 0.98 with 32, 0.98 with 4096 triangles, 1.95 one by one.
_GROUP, _FEW, _MOST = 64, 8, 2048


@njit(cache=True, nogil=True)
def _box_distance2(box, node, x, y, z):
    """Squared distance of a point to a node's box, mm^2."""
    dx = max(box[node, 0] - x, 0.0, x - box[node, 3])
    dy = max(box[node, 1] - y, 0.0, y - box[node, 4])
    dz = max(box[node, 2] - z, 0.0, z - box[node, 5])
    return dx * dx + dy * dy + dz * dz


@njit(cache=True, nogil=True)
def _on_segment(dot, length2):
    """Share of a segment nearest to a point, from its projection; 0 for a segment of no length."""
    if dot <= 0.0 or length2 <= 0.0:
        return 0.0
    return min(dot / length2, 1.0)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def find_closest(
    low, high, tri, flat, box, right, first, count, order, points, distance, triangle, closest,
    feature,
):  # fmt: skip
    """Closest triangle, point and feature of points low to high of a (3, n) array."""
    stack, far, slot = np.zeros(DEPTH, dtype=np.int64), np.zeros(DEPTH), np.int64(0)
    for i in range(low, high):
        x, y, z = points[0, i], points[1, i], points[2, i]
        if i % CHUNK == 0:
            slot = np.int64(0)
        slot, _ = _search(tri, flat, box, right, first, count, x, y, z, slot, np.inf, stack, far)
        d, v, w, code = nearest_on_triangle(tri, flat, slot, x, y, z)
        distance[i] = np.sqrt(d)
        triangle[i] = order[slot]
        feature[i] = code
        for a in range(3):
            closest[a, i] = tri[slot, a] + v * tri[slot, 3 + a] + w * tri[slot, 6 + a]


@njit(cache=True, nogil=True)
def _ball(points, low, high):
    """Middle of the box of points low to high of a (3, n) array, and half its diagonal."""
    x, y, z = points[0, low:high], points[1, low:high], points[2, low:high]
    west, south, below = x.min(), y.min(), z.min()
    dx, dy, dz = 0.5 * (x.max() - west), 0.5 * (y.max() - south), 0.5 * (z.max() - below)
    return west + dx, south + dy, below + dz, np.sqrt(dx * dx + dy * dy + dz * dz)


@njit(cache=True, nogil=True)
def _collect(tri, flat, box, right, first, count, x, y, z, within, stack, near):
    """Fill the columns of ``near`` with the triangles of leaves ``within`` a squared distance.

    Returns their number; -1 where there are too many or one has no area.
    """
    many = 0
    stack[0], depth = 0, 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if _box_distance2(box, node, x, y, z) > within:
            continue
        if right[node] >= 0:
            stack[depth], stack[depth + 1] = right[node], node + 1
            depth += 2
            continue
        if many + count[node] > near.shape[1]:
            return -1
        for s in range(first[node], first[node] + count[node]):
            if flat[s]:
                return -1
            for a in range(9):
                near[a, many] = tri[s, a]
            many += 1
    return many


@njit(cache=True, nogil=True, error_model="numpy")
def squared_distances(near, many, x, y, z, square):
    """Fill the squared distances of a point to triangles with area, (9, m); return the least.

    Those of `nearest_on_triangle`, without branches: several triangles at once, 1.8 instead of 21
    ns each.
    """
    for s in range(many):
        px, py, pz = x - near[0, s], y - near[1, s], z - near[2, s]
        bx, by, bz = near[3, s], near[4, s], near[5, s]
        cx, cy, cz = near[6, s], near[7, s], near[8, s]
        bb = bx * bx + by * by + bz * bz
        bc = bx * cx + by * cy + bz * cz
        cc = cx * cx + cy * cy + cz * cz
        d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
        d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        total = va + vb + vc
        v, w = vb / total, vc / total
        share = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        here = (va <= 0.0) & (d4 >= d3) & (d5 >= d6)
        v, w = 1.0 - share if here else v, share if here else w
        here = (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0)
        v, w = 0.0 if here else v, d2 / (d2 - d6) if here else w
        here = (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0)
        v, w = d1 / (d1 - d3) if here else v, 0.0 if here else w
        here = (d6 >= 0.0) & (d5 <= d6)
        v, w = 0.0 if here else v, 1.0 if here else w
        here = (d3 >= 0.0) & (d4 <= d3)
        v, w = 1.0 if here else v, 0.0 if here else w
        here = (d1 <= 0.0) & (d2 <= 0.0)
        v, w = 0.0 if here else v, 0.0 if here else w
        ex, ey, ez = px - v * bx - w * cx, py - v * by - w * cy, pz - v * bz - w * cz
        square[s] = ex * ex + ey * ey + ez * ez
    least = np.inf
    for s in range(many):
        least = square[s] if square[s] < least else least
    return least


@njit(cache=True, nogil=True)
def _distances_among(low, high, near, many, points, reach, close, square, distance):
    """Fill the distances of points low to high from triangles that hold the nearest of each."""
    for begin in range(low, high, _FEW):
        end = min(begin + _FEW, high)
        x, y, z, radius = _ball(points, begin, end)
        least = np.sqrt(squared_distances(near, many, x, y, z, square))
        within = (_LOOSE * min(least + 2.0 * radius, reach + radius)) ** 2
        few = 0
        for s in range(many):
            if square[s] <= within:
                for a in range(9):
                    close[a, few] = near[a, s]
                few += 1
        for i in range(begin, end):
            x, y, z = points[0, i], points[1, i], points[2, i]
            distance[i] = min(np.sqrt(squared_distances(close, few, x, y, z, square)), reach)


@njit(cache=True, nogil=True)
def find_distance(low, high, tri, flat, box, right, first, count, points, reach, distance):
    """Distance of points low to high of a (3, n) array to the triangles, at most ``reach``.

    Points that follow each other share one traversal of the tree where they are close together:
    the triangle nearest to a point is no farther from the middle of all than the nearest one there
    and twice the radius. Elsewhere each has a traversal of its own. The result is the same.
    """
    stack, far, slot = np.zeros(DEPTH, dtype=np.int64), np.zeros(DEPTH), np.int64(0)
    near, close, square = np.zeros((9, _MOST)), np.zeros((9, _MOST)), np.zeros(_MOST)
    apart, alone = 0, 0
    for begin in range(low, high, _GROUP):
        end = min(begin + _GROUP, high)
        if apart == 0:
            x, y, z, radius = _ball(points, begin, end)
            most = (_LOOSE * (reach + radius)) ** 2
            slot, best = _search(
                tri, flat, box, right, first, count, x, y, z, slot, most, stack, far
            )
            if best >= most:
                distance[begin:end] = reach
                continue
            within = (_LOOSE * min(np.sqrt(best) + 2.0 * radius, reach + radius)) ** 2
            many = _collect(tri, flat, box, right, first, count, x, y, z, within, stack, near)
            if many >= 0:
                _distances_among(begin, end, near, many, points, reach, close, square, distance)
                alone = 0
                continue
            alone = apart = min(2 * alone + 1, _GROUP)
        else:
            apart -= 1
        for i in range(begin, end):
            x, y, z = points[0, i], points[1, i], points[2, i]
            slot, best = _search(
                tri, flat, box, right, first, count, x, y, z, slot, reach * reach, stack, far
            )
            distance[i] = min(np.sqrt(best), reach)
