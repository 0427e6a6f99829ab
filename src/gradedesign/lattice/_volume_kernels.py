"""Compiled sums over a contour's triangles by which its vertices are placed for true volume."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray


@njit(cache=True, nogil=True)
def add_leaning(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    axes: NDArray[np.int8],
    leaning: FloatArray,
    area: FloatArray,
) -> None:
    """Add to every vertex a third of its triangles' area, and of that across its grid edge, mm^2.

    ``leaning`` is the volume that a vertex gains by a move along its edge, per mm.
    """
    side, n = np.zeros((2, 3)), np.zeros(3)
    for f in range(len(faces)):
        for x in range(3):
            side[0, x] = vertices[faces[f, 1], x] - vertices[faces[f, 0], x]
            side[1, x] = vertices[faces[f, 2], x] - vertices[faces[f, 0], x]
        for x in range(3):
            u, v = (x + 1) % 3, (x + 2) % 3
            n[x] = side[0, u] * side[1, v] - side[0, v] * side[1, u]
        size = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
        for c in range(3):
            vertex = faces[f, c]
            leaning[vertex] += n[axes[vertex]] / 6.0
            area[vertex] += size / 6.0


@njit(cache=True, nogil=True)
def points_and_normals(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    weights: FloatArray,
    points: FloatArray,
    normals: FloatArray,
) -> None:
    """Points of barycentric coordinates and unit normals (3, m) of triangles.

    The normal is zero where there is no area.
    """
    side, n = np.zeros((2, 3)), np.zeros(3)
    for f in range(len(faces)):
        for x in range(3):
            first = vertices[faces[f, 0], x]
            side[0, x] = vertices[faces[f, 1], x] - first
            side[1, x] = vertices[faces[f, 2], x] - first
            points[x, f] = first + weights[1] * side[0, x] + weights[2] * side[1, x]
        for x in range(3):
            u, v = (x + 1) % 3, (x + 2) % 3
            n[x] = side[0, u] * side[1, v] - side[0, v] * side[1, u]
        size = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
        for x in range(3):
            normals[x, f] = n[x] / size if size > 0 else 0.0


@njit(cache=True, nogil=True)
def share_out(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    mean: FloatArray,
    held: BoolArray,
    leaning: FloatArray,
    area: FloatArray,
    cells: tuple[FloatArray, float],
    missing: FloatArray,
    off: FloatArray,
) -> None:
    """Share the volume above every triangle out to its vertices, and add it up cell by cell.

    ``mean`` (m,) is the mean height of the surface above a triangle, mm. A vertex gets the more the
    better its edge leads out of the surface. Held vertices get none; three of them are left alone.
    ``cells`` are boxes of the size from their first corner on, and ``off`` (2, p, q, r) holds their
    volumes without and with sign.
    """
    corner, size = cells
    weight, side = np.zeros(3), np.zeros((2, 3))
    place = np.zeros(3, dtype=np.int64)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if held[a] and held[b] and held[c]:
            continue
        for x in range(3):
            side[0, x] = vertices[b, x] - vertices[a, x]
            side[1, x] = vertices[c, x] - vertices[a, x]
            middle = vertices[a, x] + (side[0, x] + side[1, x]) / 3.0
            place[x] = min(max(int((middle - corner[x]) / size), 0), off.shape[1 + x] - 1)
        square = 0.0
        for x in range(3):
            u, v = (x + 1) % 3, (x + 2) % 3
            square += (side[0, u] * side[1, v] - side[0, v] * side[1, u]) ** 2
        volume = mean[f] * 0.5 * np.sqrt(square)
        off[0, place[0], place[1], place[2]] += abs(volume)
        off[1, place[0], place[1], place[2]] += volume
        for k in range(3):
            vertex = faces[f, k]
            free = area[vertex] > 0 and not held[vertex]
            weight[k] = (leaning[vertex] / area[vertex]) ** 2 if free else 0.0
        every = weight[0] + weight[1] + weight[2]
        if every > 0:
            for k in range(3):
                missing[faces[f, k]] += volume * weight[k] / every


@njit(cache=True, nogil=True)
def move_along_edges(
    vertices: FloatArray,
    axes: NDArray[np.int8],
    missing: FloatArray,
    leaning: FloatArray,
    area: FloatArray,
    grid: tuple[FloatArray, float],
    limits: tuple[float, float, float],
) -> None:
    """Move vertices along their grid edges until each has gained the volume that it misses.

    ``limits``: least share of the area that leans across an edge, most that a vertex moves, and how
    far from the ends of its edge it stays, the latter two in grid spacings.
    """
    origin, h = grid
    least, most, gap = limits
    for v in range(len(axes)):
        if abs(leaning[v]) <= least * area[v] or area[v] <= 0:
            continue
        x = axes[v]
        move = min(max(missing[v] / leaning[v] / h, -most), most)
        place = (vertices[v, x] - origin[x]) / h
        node = np.floor(place)
        place = min(max(place + move, node + gap), node + 1.0 - gap)
        vertices[v, x] = origin[x] + h * place


@njit(cache=True, nogil=True)
def count_inside(
    values: FloatArray,
    lower: FloatArray,
    h: float,
    cells: tuple[FloatArray, float],
    counts: IntArray,
) -> None:
    """Count the nodes inside, cell by cell, of a slab less its last plane.

    Parameters
    ----------
    values : (a, b, c) array
    lower : (3,) array, mm
        First node.
    h : float, mm
    cells : ((3,) array, float), mm
        First corner and size of cubic cells.
    counts : (p, q, r) int array
        Added to.
    """
    corner, size = cells
    place = np.zeros(3, dtype=np.int64)
    for i in range(values.shape[0] - 1):
        for j in range(values.shape[1]):
            for k in range(values.shape[2]):
                if values[i, j, k] >= 0.0:
                    continue
                for x, n in enumerate((i, j, k)):
                    at = int((lower[x] + h * n - corner[x]) / size)
                    place[x] = min(max(at, 0), counts.shape[x] - 1)
                counts[place[0], place[1], place[2]] += 1
