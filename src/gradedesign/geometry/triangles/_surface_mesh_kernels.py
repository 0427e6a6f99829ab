"""Compiled sums over the triangles of a surface."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray, IntArray


@njit(cache=True, nogil=True)
def signed_volume(vertices: FloatArray, faces: IntArray) -> float:
    """Enclosed volume by the divergence theorem, from the mean vertex: cones round off less."""
    x, y, z = 0.0, 0.0, 0.0
    for v in range(len(vertices)):
        x += vertices[v, 0]
        y += vertices[v, 1]
        z += vertices[v, 2]
    x, y, z = x / len(vertices), y / len(vertices), z / len(vertices)
    total = 0.0
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
        cx, cy, cz = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
        total += (
            (vertices[i, 0] - x) * (by * cz - bz * cy)
            + (vertices[i, 1] - y) * (bz * cx - bx * cz)
            + (vertices[i, 2] - z) * (bx * cy - by * cx)
        )
    return total / 6.0


@njit(cache=True, nogil=True)
def triangle_areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Area of every triangle, ``(m,)``."""
    areas = np.zeros(len(faces))
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        bx, cx = vertices[j, 0] - vertices[i, 0], vertices[k, 0] - vertices[i, 0]
        by, cy = vertices[j, 1] - vertices[i, 1], vertices[k, 1] - vertices[i, 1]
        bz, cz = vertices[j, 2] - vertices[i, 2], vertices[k, 2] - vertices[i, 2]
        x, y, z = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        areas[f] = 0.5 * np.sqrt(x * x + y * y + z * z)
    return areas


@njit(cache=True, nogil=True)
def corners_of_box(points: FloatArray) -> FloatArray:
    """Lower and upper corner of the box around points (n, 3), ``(2, 3)``; nan is left out."""
    box = np.zeros((2, 3))
    for a in range(3):
        box[0, a], box[1, a] = np.inf, -np.inf
    for v in range(len(points)):
        for a in range(3):
            box[0, a] = min(box[0, a], points[v, a])
            box[1, a] = max(box[1, a], points[v, a])
    return box
