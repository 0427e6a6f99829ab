"""Compiled loops over surfaces: cutting at a box, edge pairing, shells and their volumes."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradedesign.arrays import FloatArray, IntArray


@njit(cache=True, nogil=True)
def cut_at_box(
    values: FloatArray, points: FloatArray, middle: FloatArray, half: FloatArray
) -> None:
    """Raise values (n,) at points (3, n) to the distance outside a box, by its faces."""
    for i in range(len(values)):
        for axis in range(3):
            outside = abs(points[axis, i] - middle[axis]) - half[axis]
            if outside > values[i]:  # what is not a number stays so
                values[i] = outside


@njit(cache=True, nogil=True)
def nudge(values: FloatArray, least: float) -> None:
    """Replace values (a, b, c) closer to zero than ``least`` by it."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            for k in range(values.shape[2]):
                if abs(values[i, j, k]) < least:
                    values[i, j, k] = least


@njit(cache=True, nogil=True)
def unpaired_edges(faces: IntArray, vertices: int) -> tuple[int, int]:
    """Edges not shared by exactly two opposed triangles: (open or misoriented, overloaded).

    The directed edges are bucketed by their lower vertex; a sound edge is met exactly once in
    each direction.
    """
    first = np.zeros(vertices + 1, dtype=np.int64)
    for f in range(len(faces)):
        for c in range(3):
            first[min(faces[f, c], faces[f, (c + 1) % 3]) + 1] += 1
    for v in range(vertices):
        first[v + 1] += first[v]
    fill = first[:-1].copy()
    far_end = np.zeros(3 * len(faces), dtype=np.int32)
    for f in range(len(faces)):
        for c in range(3):
            a, b = faces[f, c], faces[f, (c + 1) % 3]
            lower = min(a, b)
            far_end[fill[lower]] = b + 1 if a < b else -(a + 1)
            fill[lower] += 1
    torn, overloaded = 0, 0
    for v in range(vertices):
        for m in range(first[v], first[v + 1]):
            name = abs(far_end[m])
            ahead, back, earlier = 0, 0, False
            for n in range(first[v], first[v + 1]):
                if abs(far_end[n]) == name:
                    earlier = earlier or n < m
                    if far_end[n] > 0:
                        ahead += 1
                    else:
                        back += 1
            if earlier:
                continue
            if ahead + back > 2:
                overloaded += 1
            elif ahead != 1 or back != 1:
                torn += 1
    return torn, overloaded


@njit(cache=True, nogil=True)
def vertex_shells(faces: IntArray, vertices: int) -> IntArray:
    """Number of the connected shell of every vertex, in order of the shells' lowest vertex.

    Union-find with path halving; ``-1`` for a vertex without a triangle.
    """
    parent = np.arange(vertices)
    for f in range(len(faces)):
        for c in range(1, 3):
            a, b = faces[f, 0], faces[f, c]
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a != b:
                parent[max(a, b)] = min(a, b)
    used = np.zeros(vertices, dtype=np.bool_)
    for f in range(len(faces)):
        for c in range(3):
            used[faces[f, c]] = True
    label = np.full(vertices, -1, dtype=np.int64)
    count = 0
    for v in range(vertices):
        if not used[v]:
            continue
        root = v
        while parent[root] != root:
            root = parent[root]
        if label[root] < 0:
            label[root] = count
            count += 1
        label[v] = label[root]
    return label


@njit(cache=True, nogil=True)
def shell_volumes(
    vertices: FloatArray, faces: IntArray, shells: IntArray, count: int
) -> FloatArray:
    """Signed volume of every shell ``(count,)``; ``shells`` numbers the shell of each vertex."""
    x, y, z = 0.0, 0.0, 0.0  # the mean vertex: near the surface, cones round off less
    for v in range(len(vertices)):
        x += vertices[v, 0] / len(vertices)
        y += vertices[v, 1] / len(vertices)
        z += vertices[v, 2] / len(vertices)
    volumes = np.zeros(count)
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        bx, by, bz = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
        cx, cy, cz = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
        volumes[shells[i]] += (
            (vertices[i, 0] - x) * (by * cz - bz * cy)
            + (vertices[i, 1] - y) * (bz * cx - bx * cz)
            + (vertices[i, 2] - z) * (bx * cy - by * cx)
        ) / 6.0
    return volumes


@njit(cache=True, nogil=True)
def volumes_under(
    vertices: FloatArray, faces: IntArray, axis: int, planes: FloatArray, middle: float
) -> FloatArray:
    """Volumes of a closed surface below planes across an axis, sorted upwards, ``(k,)``.

    Heights are taken from ``middle``. Of a triangle cut next to its lowest corner the part below
    the plane is a similar one; next to its highest corner, the whole less the part above.
    """
    volumes = np.zeros(len(planes))
    u, v = (axis + 1) % 3, (axis + 2) % 3
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        normal = 0.5 * (
            (vertices[j, u] - vertices[i, u]) * (vertices[k, v] - vertices[i, v])
            - (vertices[j, v] - vertices[i, v]) * (vertices[k, u] - vertices[i, u])
        )
        a, b, c = vertices[i, axis] - middle, vertices[j, axis] - middle, vertices[k, axis] - middle
        low, high = min(a, b, c), max(a, b, c)
        mean = (a + b + c) / 3.0
        between = a + b + c - low - high
        for n in range(len(planes)):
            plane = planes[n] - middle
            # A triangle wholly above a plane contributes c n, and the n of all sum to zero.
            if high <= plane:
                value = mean
            elif low >= plane:
                value = plane
            elif between >= plane:
                side = max((between - low) * (high - low), 1e-300)
                value = plane - (plane - low) ** 3 / (3.0 * side)
            else:
                side = max((high - low) * (high - between), 1e-300)
                value = mean - (high - plane) ** 3 / (3.0 * side)
            volumes[n] += value * normal
    return volumes
