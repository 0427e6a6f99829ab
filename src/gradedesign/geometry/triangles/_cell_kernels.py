"""Compiled lists of the triangles in every cell of a cubic grid, and rays through them."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

from gradedesign.geometry.triangles._closest_kernels import CHUNK
from gradedesign.geometry.triangles._collapse_kernels import between
from gradedesign.geometry.triangles._ray_kernels import leaves


@njit(cache=True)
def cell_range(vertices, faces, i, origin, spacing, shape, reach, cells):
    """First and last cell of triangle i along each axis, into ``cells`` (2, 3).

    Cells that it enters by less than ``-reach`` do not count, nor those beyond the grid.
    """
    for a in range(3):
        x, y, z = vertices[faces[i, 0], a], vertices[faces[i, 1], a], vertices[faces[i, 2], a]
        low, high = min(x, y, z) - reach, max(x, y, z) + reach
        if low > high:
            low = high = 0.5 * (low + high)
        first, last = int((low - origin[a]) / spacing), int((high - origin[a]) / spacing)
        cells[0, a] = min(max(first, 0), shape[a] - 1)
        cells[1, a] = min(max(last, 0), shape[a] - 1)


@njit(cache=True, nogil=True)
def sum_extents(vertices, faces):
    """Extents of the triangles along each axis, added up, ``(3,)``."""
    size = np.zeros(3)
    for f in range(len(faces)):
        for a in range(3):
            x, y, z = vertices[faces[f, 0], a], vertices[faces[f, 1], a], vertices[faces[f, 2], a]
            size[a] += max(x, y, z) - min(x, y, z)
    return size


@njit(cache=True, nogil=True)
def count_in_cells(vertices, faces, origin, spacing, shape, reach, most, start):
    """Add the triangles of every cell to ``start[cell + 1]``; returns their sum.

    It stops where the sum exceeds ``most``.
    """
    cells = np.zeros((2, 3), dtype=np.int64)
    total = 0
    for f in range(len(faces)):
        cell_range(vertices, faces, f, origin, spacing, shape, reach, cells)
        size = 1
        for a in range(3):
            size *= cells[1, a] + 1 - cells[0, a]
        total += size
        if total > most:
            break
        for i in range(cells[0, 0], cells[1, 0] + 1):
            for j in range(cells[0, 1], cells[1, 1] + 1):
                row = (i * shape[1] + j) * shape[2] + 1
                for k in range(cells[0, 2], cells[1, 2] + 1):
                    start[row + k] += 1
    return total


@njit(cache=True, nogil=True)
def list_in_cells(vertices, faces, origin, spacing, shape, reach, start):
    """Triangles of every cell, in order, from the running sums ``start``."""
    users = np.zeros(start[-1], dtype=np.int32)
    fill = start[:-1].copy()
    cells = np.zeros((2, 3), dtype=np.int64)
    for f in range(len(faces)):
        cell_range(vertices, faces, f, origin, spacing, shape, reach, cells)
        for i in range(cells[0, 0], cells[1, 0] + 1):
            for j in range(cells[0, 1], cells[1, 1] + 1):
                for k in range(cells[0, 2], cells[1, 2] + 1):
                    at = (i * shape[1] + j) * shape[2] + k
                    users[fill[at]] = f
                    fill[at] += 1
    return users


@njit(cache=True, parallel=True, nogil=True)
def exit_lengths_in_cells(
    vertices, faces, origin, spacing, shape, start, users, origins, directions, lengths
):
    """Fill the length of every ray, (3, n), from inside to where it first leaves the solid.

    The cells are walked one by one: Amanatides & Woo, "A fast voxel traversal algorithm for ray
    tracing", Eurographics 1987.
    """
    n = origins.shape[1]
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        at, way = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
        next_wall, per_cell = np.zeros(3), np.zeros(3)
        for r in range(chunk * CHUNK, min(n, (chunk + 1) * CHUNK)):
            o = (origins[0, r], origins[1, r], origins[2, r])
            d = (directions[0, r], directions[1, r], directions[2, r])
            for a in range(3):
                at[a] = min(max(int((o[a] - origin[a]) / spacing), 0), shape[a] - 1)
                way[a] = 1 if d[a] > 0.0 else -1
                next_wall[a], per_cell[a] = np.inf, np.inf
                if d[a] != 0.0:
                    wall = origin[a] + spacing * (at[a] + (way[a] > 0))
                    next_wall[a], per_cell[a] = (wall - o[a]) / d[a], spacing / abs(d[a])
            best, entered = np.inf, 0.0
            while entered <= best:
                cell = (at[0] * shape[1] + at[1]) * shape[2] + at[2]
                for s in range(start[cell], start[cell + 1]):
                    p, q, m = faces[users[s], 0], faces[users[s], 1], faces[users[s], 2]
                    corner = vertices[p, 0], vertices[p, 1], vertices[p, 2]
                    u, v = between(vertices, p, q), between(vertices, p, m)
                    best = min(best, leaves(corner, u, v, o, d))
                a = 0
                if next_wall[1] < next_wall[a]:
                    a = 1
                if next_wall[2] < next_wall[a]:
                    a = 2
                entered = next_wall[a]
                next_wall[a] += per_cell[a]
                at[a] += way[a]
                if at[a] < 0 or at[a] >= shape[a]:
                    break
            lengths[r] = best
