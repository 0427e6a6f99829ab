"""Compiled choice of the diagonals of a contour by the surface that its vertices lie on.

Above 300 lines: fitting and flipping share the walks around a vertex.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray

#: Most neighbours of a vertex, those across the opposite sides included; a contour has 12 at most,
#: as a rule. Chosen, not measured.
_RING = 64
#: Fewer neighbours than this are joined by those across the opposite sides: a quadric has five
#: unknowns, and one point more judges it.
_FEW = 7
#: Neighbours farther from the quadric than this share of the spacing: it is no smooth surface.
#: Chosen, not measured.
_SMOOTH = 0.15
#: Flips that bring the middle of a side less nearer to the surface, in spacings, are not made: they
#: would be undone by rounding. Chosen, not measured.
_LEAST = 1e-4
#: Least cosine between a triangle and the normals at its corners, and least area in spacings^2.
#: Chosen, not measured.
_COSINE, _AREA = 0.7, 0.01
#: Times that all triangles are visited at most. Chosen, not measured.
_PASSES = 8


@njit(cache=True, nogil=True)
def opposite_triangles(faces: NDArray[np.int32], count: int) -> NDArray[np.int32]:
    """Triangle across the side from each corner to the next, ``(m, 3)``; -1 where there is none.

    Sides are bucketed by their lower vertex.
    """
    first = np.zeros(count + 1, dtype=np.int32)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        first[min(a, b) + 1] += 1
        first[min(b, c) + 1] += 1
        first[min(c, a) + 1] += 1
    for v in range(count):
        first[v + 1] += first[v]
    fill = first[:-1].copy()
    side = np.zeros(3 * len(faces), dtype=np.int32)
    far = np.zeros(3 * len(faces), dtype=np.int32)  # the upper vertex, negative where first
    for f in range(len(faces)):
        tail = faces[f, 0]
        for c in range(3):
            head = faces[f, c + 1 if c < 2 else 0]
            lower = min(tail, head)
            side[fill[lower]] = 3 * f + c
            far[fill[lower]] = head if tail == lower else -tail
            fill[lower] += 1
            tail = head
    opposite = np.full((len(faces), 3), -1, dtype=np.int32)
    for v in range(count):
        for m in range(first[v], first[v + 1]):
            for n in range(first[v], m):
                if far[m] == -far[n]:
                    opposite[side[m] // 3, side[m] % 3] = side[n] // 3
                    opposite[side[n] // 3, side[n] % 3] = side[m] // 3
    return opposite


@njit(cache=True, nogil=True)
def _corner(faces: NDArray[np.int32], f: int, v: int) -> int:
    """Corner of a triangle at which a vertex is."""
    if faces[f, 0] == v:
        return 0
    return 1 if faces[f, 1] == v else 2


@njit(cache=True, nogil=True)
def _neighbours(
    faces: NDArray[np.int32],
    opposite: NDArray[np.int32],
    start: int,
    v: int,
    few: int,
    ring: NDArray[np.int32],
) -> tuple[int, int]:
    """Write the neighbours of a vertex in order, and if they are few those across from it.

    Returns how many are neighbours, 0 at an open side, and how many are written.
    """
    f, near = start, 0
    while True:
        c = _corner(faces, f, v)
        ring[near] = faces[f, (c + 1) % 3]
        near += 1
        f = opposite[f, (c + 2) % 3]
        if f == start:
            break
        if f < 0 or 2 * near == len(ring):
            return 0, 0
    every = near
    if near < few:
        for _ in range(near):
            c = _corner(faces, f, v)
            g = opposite[f, (c + 1) % 3]
            if g >= 0:
                ring[every] = faces[g, (_corner(faces, g, faces[f, (c + 2) % 3]) + 2) % 3]
                every += 1
            f = opposite[f, (c + 2) % 3]
    return near, every


@njit(cache=True, nogil=True)
def _slopes(
    a: FloatArray, b: FloatArray, height: FloatArray, count: int
) -> tuple[float, float, float, float, float]:
    """Coefficients of a, b, a^2, a b and b^2 that fit heights, near ones most; nan if singular.

    Normal equations by Cholesky, written out: loops over so few take twice as long.
    """
    m00, m10, m11, m20, m21, m22, m30, m31 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    m32, m33, m40, m41, m42, m43, m44 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    r0, r1, r2, r3, r4 = 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(count):
        p, q, z = a[m], b[m], height[m]
        pp, pq, qq = p * p, p * q, q * q
        w = 1.0 / (pp + qq + 1e-3)
        w0, w1, w2, w3, w4 = w * p, w * q, w * pp, w * pq, w * qq
        m00 += w0 * p
        m10 += w1 * p
        m11 += w1 * q
        m20 += w2 * p
        m21 += w2 * q
        m22 += w2 * pp
        m30 += w3 * p
        m31 += w3 * q
        m32 += w3 * pp
        m33 += w3 * pq
        m40 += w4 * p
        m41 += w4 * q
        m42 += w4 * pp
        m43 += w4 * pq
        m44 += w4 * qq
        r0 += w0 * z
        r1 += w1 * z
        r2 += w2 * z
        r3 += w3 * z
        r4 += w4 * z
    none = (np.nan, np.nan, np.nan, np.nan, np.nan)
    least = 1e-6
    m00 += least
    m00 = np.sqrt(m00)
    m10, m20, m30, m40 = m10 / m00, m20 / m00, m30 / m00, m40 / m00
    m11 += least - m10 * m10
    if m11 <= least:
        return none
    m11 = np.sqrt(m11)
    m21, m31, m41 = (m21 - m20 * m10) / m11, (m31 - m30 * m10) / m11, (m41 - m40 * m10) / m11
    m22 += least - m20 * m20 - m21 * m21
    if m22 <= least:
        return none
    m22 = np.sqrt(m22)
    m32, m42 = (m32 - m30 * m20 - m31 * m21) / m22, (m42 - m40 * m20 - m41 * m21) / m22
    m33 += least - m30 * m30 - m31 * m31 - m32 * m32
    if m33 <= least:
        return none
    m33 = np.sqrt(m33)
    m43 = (m43 - m40 * m30 - m41 * m31 - m42 * m32) / m33
    m44 += least - m40 * m40 - m41 * m41 - m42 * m42 - m43 * m43
    if m44 <= least:
        return none
    m44 = np.sqrt(m44)
    r0 /= m00
    r1 = (r1 - m10 * r0) / m11
    r2 = (r2 - m20 * r0 - m21 * r1) / m22
    r3 = (r3 - m30 * r0 - m31 * r1 - m32 * r2) / m33
    r4 = (r4 - m40 * r0 - m41 * r1 - m42 * r2 - m43 * r3) / m44
    r4 /= m44
    r3 = (r3 - m43 * r4) / m33
    r2 = (r2 - m32 * r3 - m42 * r4) / m22
    r1 = (r1 - m21 * r2 - m31 * r3 - m41 * r4) / m11
    r0 = (r0 - m10 * r1 - m20 * r2 - m30 * r3 - m40 * r4) / m00
    return r0, r1, r2, r3, r4


@njit(cache=True, nogil=True)
def _frame(off: FloatArray, near: int, frame: FloatArray) -> bool:
    """Unit vectors along and across the fan of neighbours ``off`` (k, 3), the last its normal."""
    n = frame[2]
    for x in range(3):
        n[x] = 0.0
    for m in range(near):
        k = (m + 1) % near
        for x in range(3):
            y, z = (x + 1) % 3, (x + 2) % 3
            n[x] += off[m, y] * off[k, z] - off[m, z] * off[k, y]
    size = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    if size < 1e-9:
        return False
    least = 0
    for x in range(3):
        n[x] /= size
        if abs(n[x]) < abs(n[least]):
            least = x
    size = np.sqrt(1.0 - n[least] ** 2)
    for x in range(3):
        frame[0, x] = ((x == least) - n[least] * n[x]) / size
    for x in range(3):
        y, z = (x + 1) % 3, (x + 2) % 3
        frame[1, x] = n[y] * frame[0, z] - n[z] * frame[0, y]
    return True


@njit(cache=True, nogil=True)
def fitted_normals(
    vertices: FloatArray, faces: NDArray[np.int32], opposite: NDArray[np.int32], h: float
) -> NDArray[np.float32]:
    """Unit normals at vertices (n, 3) on a smooth surface, ``(n, 3)``; zero elsewhere.

    Of the quadric through the vertex that fits its neighbours, near ones most.
    """
    normals = np.zeros((len(vertices), 3), dtype=np.float32)
    seat = np.full(len(vertices), -1, dtype=np.int32)
    for f in range(len(faces)):
        for c in range(3):
            seat[faces[f, c]] = f
    ring = np.zeros(_RING, dtype=np.int32)
    off, frame = np.zeros((_RING, 3)), np.zeros((3, 3))
    a, b, height = np.zeros(_RING), np.zeros(_RING), np.zeros(_RING)
    for v in range(len(vertices)):
        if seat[v] < 0:
            continue
        near, every = _neighbours(faces, opposite, np.int64(seat[v]), v, _FEW, ring)
        for m in range(every):
            for x in range(3):
                off[m, x] = (vertices[ring[m], x] - vertices[v, x]) / h
        if near < 3 or not _frame(off, near, frame):
            continue
        for m in range(every):
            a[m] = off[m, 0] * frame[0, 0] + off[m, 1] * frame[0, 1] + off[m, 2] * frame[0, 2]
            b[m] = off[m, 0] * frame[1, 0] + off[m, 1] * frame[1, 1] + off[m, 2] * frame[1, 2]
            height[m] = off[m, 0] * frame[2, 0] + off[m, 1] * frame[2, 1] + off[m, 2] * frame[2, 2]
        coefficients = _slopes(a, b, height, every)
        smooth = not np.isnan(coefficients[0])
        for m in range(every):
            misfit = height[m] - coefficients[0] * a[m] - coefficients[1] * b[m]
            misfit -= (
                coefficients[2] * a[m] * a[m]
                + coefficients[3] * a[m] * b[m]
                + coefficients[4] * b[m] * b[m]
            )
            smooth &= abs(misfit) <= _SMOOTH
        if smooth:
            size = np.sqrt(1.0 + coefficients[0] ** 2 + coefficients[1] ** 2)
            for x in range(3):
                slope = coefficients[0] * frame[0, x] + coefficients[1] * frame[1, x]
                normals[v, x] = (frame[2, x] - slope) / size
    return normals


@njit(cache=True, nogil=True)
def _distance(vertices: FloatArray, normals: NDArray[np.float32], a: int, b: int) -> float:
    """Distance from the middle of a side to the curve with the normals at its ends."""
    total = 0.0
    for x in range(3):
        total += (vertices[b, x] - vertices[a, x]) * (normals[b, x] - normals[a, x])
    return abs(total) / 8.0


@njit(cache=True, nogil=True)
def _faces_out(
    vertices: FloatArray, normals: NDArray[np.float32], a: int, b: int, c: int, h: float
) -> bool:
    """Whether a triangle is along the surface at its corners, and no sliver."""
    n = np.zeros(3)
    for x in range(3):
        y, z = (x + 1) % 3, (x + 2) % 3
        n[x] = (vertices[b, y] - vertices[a, y]) * (vertices[c, z] - vertices[a, z]) - (
            vertices[b, z] - vertices[a, z]
        ) * (vertices[c, y] - vertices[a, y])
    size = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    least = size
    for v in (a, b, c):
        least = min(least, n[0] * normals[v, 0] + n[1] * normals[v, 1] + n[2] * normals[v, 2])
    return size >= 2.0 * _AREA * h * h and least >= _COSINE * size


@njit(cache=True, nogil=True)
def _cubes(vertices: FloatArray, a: int, b: int, c: int, origin: FloatArray, h: float) -> int:
    """Count the grid cubes in the bounding box of three vertices; 0 if it lies in a cube's face."""
    cubes = 1
    for x in range(3):
        i, j, k = vertices[a, x], vertices[b, x], vertices[c, x]
        low = np.floor((min(i, j, k) - origin[x]) / h + 1e-4)
        high = np.ceil((max(i, j, k) - origin[x]) / h - 1e-4)
        cubes *= int(high - low)
    return cubes


@njit(cache=True, nogil=True)
def _is_better(
    vertices: FloatArray,
    normals: NDArray[np.float32],
    quad: tuple[int, int, int, int],
    origin: FloatArray,
    h: float,
) -> bool:
    """Whether triangles a, e, c and e, b, c are to take the place of a, b, c and b, a, e."""
    a, b, c, e = quad
    now = _distance(vertices, normals, a, b)
    if now <= _LEAST * h or _distance(vertices, normals, c, e) + _LEAST * h > now:
        return False
    return (
        _faces_out(vertices, normals, a, e, c, h)
        and _faces_out(vertices, normals, e, b, c, h)
        and _cubes(vertices, c, e, c, origin, h) > 0
        and _cubes(vertices, a, e, c, origin, h) <= 2
        and _cubes(vertices, e, b, c, origin, h) <= 2
    )


@njit(cache=True, nogil=True)
def flip_diagonals(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    opposite: NDArray[np.int32],
    normals: NDArray[np.float32],
    ends: IntArray,
    origin: FloatArray,
    h: float,
) -> int:
    """Flip sides of triangles in place wherever the middle comes nearer to the surface.

    Parameters
    ----------
    ends : (2,) int array
        Numbers of the first triangles of the second and third group: no side between is flipped.
    origin : (3,) array
        A node of the grid.

    Returns
    -------
    int
        Number of flips. A triangle then lies in at most two neighbouring cubes, no new side in a
        face between two, and every side is shared by two triangles as before.
    """
    open_ones = np.ones(len(faces), dtype=np.bool_)
    ring = np.zeros(_RING, dtype=np.int32)
    flips = 0
    for _ in range(_PASSES):
        before = flips
        for t in range(len(faces)):
            if not open_ones[t]:
                continue
            open_ones[t] = False
            group = (t >= ends[0]) + (t >= ends[1])
            for k in range(3):
                u = opposite[t, k]
                # Where the other one is closed, this side was tried from there.
                if u < 0 or not open_ones[u] or group != (u >= ends[0]) + (u >= ends[1]):
                    continue
                a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
                s = _corner(faces, u, b)
                e = faces[u, (s + 2) % 3]
                if not _is_better(vertices, normals, (a, b, c, e), origin, h):
                    continue
                near, _ = _neighbours(faces, opposite, t, c, 0, ring)
                bc, ca = opposite[t, (k + 1) % 3], opposite[t, (k + 2) % 3]
                ae, eb = opposite[u, (s + 1) % 3], opposite[u, (s + 2) % 3]
                taken = near == 0 or min(bc, ca, ae, eb) < 0
                for m in range(near):
                    taken |= ring[m] == e
                if taken:
                    continue
                # t (a, b, c) and u (b, a, e) become (a, e, c) and (e, b, c).
                faces[t, 0], faces[t, 1], faces[t, 2] = a, e, c
                faces[u, 0], faces[u, 1], faces[u, 2] = e, b, c
                opposite[t, 0], opposite[t, 1], opposite[t, 2] = ae, u, ca
                opposite[u, 0], opposite[u, 1], opposite[u, 2] = eb, bc, t
                opposite[bc, _corner(faces, bc, c)] = u
                opposite[ae, _corner(faces, ae, e)] = t
                open_ones[t] = open_ones[u] = open_ones[bc] = open_ones[ca] = True
                open_ones[ae] = open_ones[eb] = True
                flips += 1
                break
        if flips == before:
            break
    return flips
