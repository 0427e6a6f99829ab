"""Compiled winding numbers of any triangles about points, by the moments of a tree's nodes."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.geometry.triangles._tree_kernels import DEPTH

#: A node farther than this many of its radii is taken by its moments, and a triangle farther than
#: this many of its edges by its area.
FAR, FAR_TRIANGLE = 2.0, 3.0


@njit(cache=True, nogil=True)
def _solid_angle(ax, ay, az, bx, by, bz, cx, cy, cz):
    """Solid angle of a triangle seen from the origin, positive from behind."""
    la = np.sqrt(ax * ax + ay * ay + az * az)
    lb = np.sqrt(bx * bx + by * by + bz * bz)
    lc = np.sqrt(cx * cx + cy * cy + cz * cz)
    triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    below = (
        la * lb * lc
        + (ax * bx + ay * by + az * bz) * lc
        + (bx * cx + by * cy + bz * cz) * la
        + (cx * ax + cy * ay + cz * az) * lb
    )
    return 2.0 * np.arctan2(triple, below)


@njit(cache=True, nogil=True)
def fill_moments(low, high, tri, turn, box, first, count, moments):
    """Moments of nodes low to high.

    Parameters
    ----------
    tri : (m, 9) array, mm
        First corner and two edge vectors.
    turn : (m,) int8 array
        -1 where a triangle counts turned around.
    box, first, count : arrays
        As in :class:`gradedesign.geometry.triangles.triangle_tree.TriangleTree`.
    moments : (k, 16) array
        Filled with the centre (3), the squared distance from which moments serve, the area vector
        (3) and its first moment about the centre (3, 3).
    """
    for node in range(low, high):
        own = moments[node]
        for a in range(16):
            own[a] = 0.0
        total = 0.0
        begin, end = first[node], first[node] + count[node]
        for s in range(begin, end):
            nx, ny, nz = _area(tri, s)
            area = np.sqrt(nx * nx + ny * ny + nz * nz)
            total += area
            for a in range(3):
                own[a] += area * (tri[s, a] + (tri[s, 3 + a] + tri[s, 6 + a]) / 3.0)
        for a in range(3):
            if total > 0.0:
                own[a] /= total
            else:
                own[a] = 0.5 * (box[node, a] + box[node, 3 + a])
            far = max(own[a] - box[node, a], box[node, 3 + a] - own[a])
            own[3] += far * far
        own[3] *= FAR * FAR
        for s in range(begin, end):
            n = _area(tri, s)
            for a in range(3):
                own[4 + a] += turn[s] * n[a]
                apart = tri[s, a] + (tri[s, 3 + a] + tri[s, 6 + a]) / 3.0 - own[a]
                for b in range(3):
                    own[7 + 3 * a + b] += turn[s] * apart * n[b]


@njit(cache=True, nogil=True)
def _area(tri, s):
    """Area vector of a triangle."""
    bx, by, bz = tri[s, 3], tri[s, 4], tri[s, 5]
    cx, cy, cz = tri[s, 6], tri[s, 7], tri[s, 8]
    return (
        0.5 * (by * cz - bz * cy),
        0.5 * (bz * cx - bx * cz),
        0.5 * (bx * cy - by * cx),
    )


@njit(cache=True, nogil=True)
def _angle(tri, s, x, y, z):
    """Solid angle of a triangle seen from a point, positive from behind."""
    ax, ay, az = tri[s, 0] - x, tri[s, 1] - y, tri[s, 2] - z
    bx, by, bz = ax + tri[s, 3], ay + tri[s, 4], az + tri[s, 5]
    cx, cy, cz = ax + tri[s, 6], ay + tri[s, 7], az + tri[s, 8]
    return _solid_angle(ax, ay, az, bx, by, bz, cx, cy, cz)


@njit(cache=True, nogil=True)
def _seen(tri, s, x, y, z):
    """Solid angle of a triangle, by its area vector where it is far."""
    bx, by, bz = tri[s, 3], tri[s, 4], tri[s, 5]
    cx, cy, cz = tri[s, 6], tri[s, 7], tri[s, 8]
    rx = tri[s, 0] + (bx + cx) / 3.0 - x
    ry = tri[s, 1] + (by + cy) / 3.0 - y
    rz = tri[s, 2] + (bz + cz) / 3.0 - z
    r2 = rx * rx + ry * ry + rz * rz
    long2 = max(bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz)
    if r2 <= FAR_TRIANGLE * FAR_TRIANGLE * long2:
        return _angle(tri, s, x, y, z)
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    return 0.5 * (nx * rx + ny * ry + nz * rz) / (r2 * np.sqrt(r2))


@njit(cache=True, nogil=True)
def _winding(tri, turn, right, first, count, moments, x, y, z, stack):
    """Winding number about a point."""
    total = 0.0
    stack[0], depth = 0, 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        own = moments[node]
        rx, ry, rz = own[0] - x, own[1] - y, own[2] - z
        r2 = rx * rx + ry * ry + rz * rz
        if r2 > own[3]:
            quadratic = (
                rx * (own[7] * rx + own[8] * ry + own[9] * rz)
                + ry * (own[10] * rx + own[11] * ry + own[12] * rz)
                + rz * (own[13] * rx + own[14] * ry + own[15] * rz)
            )
            linear = own[4] * rx + own[5] * ry + own[6] * rz + own[7] + own[11] + own[15]
            total += (linear - 3.0 * quadratic / r2) / (r2 * np.sqrt(r2))
        elif right[node] >= 0:
            stack[depth], stack[depth + 1] = node + 1, right[node]
            depth += 2
        else:
            for s in range(first[node], first[node] + count[node]):
                total += turn[s] * _seen(tri, s, x, y, z)
    return total / (4.0 * np.pi)


@njit(cache=True, nogil=True)
def find_windings(low, high, tri, turn, right, first, count, moments, points, result):
    """Fill the winding number about points low to high of a (3, n) array."""
    stack = np.zeros(DEPTH, dtype=np.int64)
    for i in range(low, high):
        x, y, z = points[0, i], points[1, i], points[2, i]
        result[i] = _winding(tri, turn, right, first, count, moments, x, y, z, stack)


@njit(cache=True, nogil=True)
def find_rises(low, high, tri, turn, right, first, count, moments, share, suspect, rise):
    """Fill the rise of the others' winding number from behind suspects low to high to their front.

    It is taken at ``share`` of the inscribed circle's radius before and behind the triangle's
    middle; 0 for a triangle without area.
    """
    stack, middle = np.zeros(DEPTH, dtype=np.int64), np.zeros(3)
    for s in range(low, high):
        if not suspect[s]:
            continue
        n = _area(tri, s)
        area = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        around = 0.0
        for e in range(3):
            square = 0.0
            for a in range(3):
                b, c = tri[s, 3 + a], tri[s, 6 + a]
                side = b if e == 0 else (c if e == 1 else c - b)
                square += side * side
                middle[a] = tri[s, a] + (b + c) / 3.0
            around += np.sqrt(square)
        rise[s] = 0.0
        if not area > 1e-12 * around * around:
            continue
        step = share * turn[s] * 2.0 / around  # times the area vector: a share of the radius
        for side in (-1.0, 1.0):
            x = middle[0] + side * step * n[0]
            y = middle[1] + side * step * n[1]
            z = middle[2] + side * step * n[2]
            others = _winding(tri, turn, right, first, count, moments, x, y, z, stack)
            others -= turn[s] * _angle(tri, s, x, y, z) / (4.0 * np.pi)
            rise[s] += side * others
