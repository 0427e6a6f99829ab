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


@njit(cache=True, nogil=True, inline="always")
def _cell_of(
    point: FloatArray,
    cells: tuple[FloatArray, FloatArray, float],
    shape: tuple[int, ...],
    place: IntArray,
) -> bool:
    """Find the cell of a point; False outside of the box, where nothing is printed."""
    lower, upper, size = cells
    for x in range(3):
        if not lower[x] <= point[x] <= upper[x]:
            return False
        place[x] = min(int((point[x] - lower[x]) / size), shape[x] - 1)
    return True


@njit(cache=True, nogil=True)
def share_out(
    vertices: FloatArray,
    faces: NDArray[np.int32],
    mean: FloatArray,
    held: BoolArray,
    leaning: FloatArray,
    area: FloatArray,
    cells: tuple[FloatArray, FloatArray, float],
    missing: FloatArray,
    off: FloatArray,
) -> None:
    """Share the volume above every triangle out to its vertices, and add it up cell by cell.

    ``mean`` (m,) is the mean height of the surface above a triangle, mm. A vertex gets the more the
    better its edge leads out of the surface. Held vertices get none; three of them are left alone.
    ``cells`` are first and last corner of a box and the size of its cells, and ``off`` (2, p, q, r)
    holds their volumes without and with sign.
    """
    weight, side, middle = np.zeros(3), np.zeros((2, 3)), np.zeros(3)
    place = np.zeros(3, dtype=np.int64)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if held[a] and held[b] and held[c]:
            continue
        for x in range(3):
            side[0, x] = vertices[b, x] - vertices[a, x]
            side[1, x] = vertices[c, x] - vertices[a, x]
            middle[x] = vertices[a, x] + (side[0, x] + side[1, x]) / 3.0
        square = 0.0
        for x in range(3):
            u, v = (x + 1) % 3, (x + 2) % 3
            square += (side[0, u] * side[1, v] - side[0, v] * side[1, u]) ** 2
        volume = mean[f] * 0.5 * np.sqrt(square)
        if _cell_of(middle, cells, off.shape[1:], place):
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
    cells: tuple[FloatArray, FloatArray, float],
    short: FloatArray,
) -> None:
    """Move vertices along their grid edges until each has gained the volume that it misses.

    ``limits``: least share of the area that leans across an edge, most that a vertex moves, and how
    far from the ends of its edge it stays, the latter two in grid spacings. ``cells`` are as in
    `share_out`, and ``short`` (p, q, r) takes the volumes that are not gained for these limits.
    """
    origin, h = grid
    least, most, gap = limits
    box = np.zeros(3, dtype=np.int64)
    for v in range(len(axes)):
        gained = 0.0
        if area[v] > 0 and abs(leaning[v]) > least * area[v]:
            x = axes[v]
            move = min(max(missing[v] / leaning[v] / h, -most), most)
            place = (vertices[v, x] - origin[x]) / h
            node = np.floor(place)
            moved = min(max(place + move, node + gap), node + 1.0 - gap)
            vertices[v, x] = origin[x] + h * moved
            gained = (moved - place) * h * leaning[v]
        if _cell_of(vertices[v], cells, short.shape, box):
            short[box[0], box[1], box[2]] += missing[v] - gained


@njit(cache=True, nogil=True)
def count_inside(
    values: FloatArray,
    lower: FloatArray,
    h: float,
    cells: tuple[FloatArray, FloatArray, float],
    counts: IntArray,
) -> None:
    """Count the nodes inside, cell by cell, of a slab less its last plane.

    Parameters
    ----------
    values : (a, b, c) array
    lower : (3,) array, mm
        First node.
    h : float, mm
    cells : ((3,) array, (3,) array, float), mm
        First and last corner of the box, outside of which nodes do not count, and the edge of its
        cubic cells.
    counts : (p, q, r) int array
        Added to.
    """
    place, node = np.zeros(3, dtype=np.int64), np.zeros(3)
    for i in range(values.shape[0] - 1):
        for j in range(values.shape[1]):
            for k in range(values.shape[2]):
                if values[i, j, k] >= 0.0:
                    continue
                for x, n in enumerate((i, j, k)):
                    node[x] = lower[x] + h * n
                if _cell_of(node, cells, counts.shape, place):
                    counts[place[0], place[1], place[2]] += 1
