"""Compiled loops of the writers and their read-back: equal corners, normals, edges, volume."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, inline="always")
def _mixed(word):
    """Spread a word over all bits: splitmix64 (Steele, Lea and Flood, OOPSLA 2014)."""
    word = word + np.uint64(0x9E3779B97F4A7C15)
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))


@njit(cache=True, inline="always")
def _key(x, y, z):
    """Hash of the bits of a point's coordinates."""
    word = _mixed(np.uint64(x))
    word = _mixed(word + np.uint64(y))
    return _mixed(word + np.uint64(z))


@njit(cache=True, nogil=True)
def first_equal(bits):
    """Earliest point with the coordinates of each point (n, 3 words), by an open hash table."""
    n = len(bits)
    size = 16
    while size < 2 * n:
        size *= 2
    mask = np.uint64(size - 1)
    table = np.full(size, -1, dtype=np.int32)
    first = np.zeros(n, dtype=np.int32)
    for i in range(n):
        at = _key(bits[i, 0], bits[i, 1], bits[i, 2]) & mask
        first[i] = i
        while table[at] >= 0:
            j = table[at]
            if bits[i, 0] == bits[j, 0] and bits[i, 1] == bits[j, 1] and bits[i, 2] == bits[j, 2]:
                first[i] = j
                break
            at = (at + np.uint64(1)) & mask
        if first[i] == i:
            table[at] = i
    return first


@njit(cache=True, nogil=True)
def triangle_numbers(vertices, faces, numbers):
    """Fill unit normal and three corners of triangles, ``(m, 12)`` float32."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy, uz = (
            vertices[b, 0] - vertices[a, 0],
            vertices[b, 1] - vertices[a, 1],
            vertices[b, 2] - vertices[a, 2],
        )
        vx, vy, vz = (
            vertices[c, 0] - vertices[a, 0],
            vertices[c, 1] - vertices[a, 1],
            vertices[c, 2] - vertices[a, 2],
        )
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(x * x + y * y + z * z)
        scale = 1.0 / length if length > 0.0 else 0.0
        numbers[f, 0], numbers[f, 1], numbers[f, 2] = x * scale, y * scale, z * scale
        for axis in range(3):
            numbers[f, 3 + axis] = vertices[a, axis]
            numbers[f, 6 + axis] = vertices[b, axis]
            numbers[f, 9 + axis] = vertices[c, axis]


@njit(cache=True, nogil=True)
def directed_balance(bits):
    """Sum over triangles (m, 3 corners, 3 words): hash of directed less that of reversed edges."""
    turn = np.uint64(0x9E3779B97F4A7C15)
    total = np.uint64(0)
    for f in range(len(bits)):
        a = _key(bits[f, 0, 0], bits[f, 0, 1], bits[f, 0, 2])
        b = _key(bits[f, 1, 0], bits[f, 1, 1], bits[f, 1, 2])
        c = _key(bits[f, 2, 0], bits[f, 2, 1], bits[f, 2, 2])
        for start, end in ((a, b), (b, c), (c, a)):
            total += _mixed(start * turn + end) - _mixed(end * turn + start)
    return total


@njit(cache=True, nogil=True)
def cone_volume(corners, x, y, z):
    """Sum of the signed volumes of the cones from a point to triangles (m, 3, 3)."""
    total = 0.0
    for f in range(len(corners)):
        ax, ay, az = corners[f, 0, 0] - x, corners[f, 0, 1] - y, corners[f, 0, 2] - z
        bx, by, bz = corners[f, 1, 0] - x, corners[f, 1, 1] - y, corners[f, 1, 2] - z
        cx, cy, cz = corners[f, 2, 0] - x, corners[f, 2, 1] - y, corners[f, 2, 2] - z
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0
