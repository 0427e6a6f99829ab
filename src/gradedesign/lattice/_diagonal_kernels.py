"""Compiled choice of the diagonals of a contour by the surface that its vertices lie on.

Above 300 lines: fitting and flipping share the walks around a vertex.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray

#: Most neighbours of a vertex, those across the opposite sides included.
_RING = 64
#: Fewer neighbours than this are joined by those across the opposite sides.
_FEW = 7
#: Neighbours farther from the quadric than this share of the spacing: it is no smooth surface.
_SMOOTH = 0.15
#: Flips that bring the middle of a side less nearer to the surface, in spacings, are not made.
_LEAST = 1e-4
#: Least cosine between a triangle and the normals at its corners, and least area in spacings^2.
_COSINE, _AREA = 0.7, 0.01
#: Times that all triangles are visited at most.
_PASSES = 8


@njit(cache=True, nogil=True)
def opposite_triangles(faces: NDArray[np.int32], count: int) -> NDArray[np.int32]:
    """Triangle across the side from each corner to the next, ``(m, 3)``; -1 where there is none.

    Sides are bucketed by their lower vertex.
    """
    first = np.zeros(count + 1, dtype=np.int32)
    for f in range(len(faces)):
        for c in range(3):
            first[min(faces[f, c], faces[f, (c + 1) % 3]) + 1] += 1
    for v in range(count):
        first[v + 1] += first[v]
    fill = first[:-1].copy()
    side = np.zeros(3 * len(faces), dtype=np.int32)
    for f in range(len(faces)):
        for c in range(3):
            lower = min(faces[f, c], faces[f, (c + 1) % 3])
            side[fill[lower]] = 3 * f + c
            fill[lower] += 1
    opposite = np.full((len(faces), 3), -1, dtype=np.int32)
    for v in range(count):
        for m in range(first[v], first[v + 1]):
            f, c = side[m] // 3, side[m] % 3
            for n in range(first[v], m):
                g, d = side[n] // 3, side[n] % 3
                if faces[f, c] == faces[g, (d + 1) % 3] and faces[g, d] == faces[f, (c + 1) % 3]:
                    opposite[f, c] = g
                    opposite[g, d] = f
    return opposite


@njit(cache=True)
def _corner(faces: NDArray[np.int32], f: int, v: int) -> int:
    """Corner of a triangle at which a vertex is."""
    if faces[f, 0] == v:
        return 0
    return 1 if faces[f, 1] == v else 2


@njit(cache=True)
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


@njit(cache=True)
def _solved(matrix: FloatArray, right: FloatArray) -> bool:
    """Solve a symmetric positive system in place by Cholesky; False if it is singular."""
    size = len(right)
    for i in range(size):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if j < i:
                matrix[i, j] = total / matrix[j, j]
            elif total > 1e-6:
                matrix[i, i] = np.sqrt(total)
            else:
                return False
    for i in range(size):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]
    return True


@njit(cache=True)
def _frame(off: FloatArray, near: int, frame: FloatArray) -> bool:
    """Unit vectors along and across the fan of neighbours ``off`` (k, 3), the last its normal."""
    n = frame[2]
    n[:] = 0.0
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
    off, terms = np.zeros((_RING, 3)), np.zeros((_RING, 6))
    matrix, right, frame = np.zeros((5, 5)), np.zeros(5), np.zeros((3, 3))
    for v in range(len(vertices)):
        if seat[v] < 0:
            continue
        near, every = _neighbours(faces, opposite, seat[v], v, _FEW, ring)
        for m in range(every):
            for x in range(3):
                off[m, x] = (vertices[ring[m], x] - vertices[v, x]) / h
        if near < 3 or not _frame(off, near, frame):
            continue
        matrix[:] = 0.0
        right[:] = 0.0
        for m in range(every):
            a = off[m, 0] * frame[0, 0] + off[m, 1] * frame[0, 1] + off[m, 2] * frame[0, 2]
            b = off[m, 0] * frame[1, 0] + off[m, 1] * frame[1, 1] + off[m, 2] * frame[1, 2]
            height = off[m, 0] * frame[2, 0] + off[m, 1] * frame[2, 1] + off[m, 2] * frame[2, 2]
            row = terms[m]
            row[0], row[1], row[2], row[3], row[4], row[5] = a, b, a * a, a * b, b * b, height
            weight = 1.0 / (a * a + b * b + 1e-3)
            for i in range(5):
                for j in range(i + 1):
                    matrix[i, j] += weight * row[i] * row[j]
                right[i] += weight * row[i] * height
        for i in range(5):
            matrix[i, i] += 1e-6
        if not _solved(matrix, right):
            continue
        smooth = True
        for m in range(every):
            height = terms[m, 5]
            for i in range(5):
                height -= right[i] * terms[m, i]
            smooth &= abs(height) <= _SMOOTH
        if smooth:
            size = np.sqrt(1.0 + right[0] ** 2 + right[1] ** 2)
            for x in range(3):
                slope = right[0] * frame[0, x] + right[1] * frame[1, x]
                normals[v, x] = (frame[2, x] - slope) / size
    return normals


@njit(cache=True)
def _distance(vertices: FloatArray, normals: NDArray[np.float32], a: int, b: int) -> float:
    """Distance from the middle of a side to the curve with the normals at its ends."""
    total = 0.0
    for x in range(3):
        total += (vertices[b, x] - vertices[a, x]) * (normals[b, x] - normals[a, x])
    return abs(total) / 8.0


@njit(cache=True)
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


@njit(cache=True)
def _cubes(vertices: FloatArray, a: int, b: int, c: int, origin: FloatArray, h: float) -> int:
    """Number of cubes in the least box of cubes around three vertices; 0 in a face of one."""
    cubes = 1
    for x in range(3):
        i, j, k = vertices[a, x], vertices[b, x], vertices[c, x]
        low = np.floor((min(i, j, k) - origin[x]) / h + 1e-4)
        high = np.ceil((max(i, j, k) - origin[x]) / h - 1e-4)
        cubes *= int(high - low)
    return cubes


@njit(cache=True)
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
    marked: int,
    origin: FloatArray,
    h: float,
) -> int:
    """Flip sides of triangles in place wherever the middle comes nearer to the surface.

    Parameters
    ----------
    marked : int
        So many triangles come first and stay apart from the others: no side between is flipped.
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
            for k in range(3):
                u = opposite[t, k]
                if u < 0 or (t < marked) != (u < marked):
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
