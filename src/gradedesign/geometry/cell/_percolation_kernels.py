"""Union of periodic grid nodes in the order of their values, with every component's windings."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import IntArray

# Columns of the history that `flood` writes.
LARGEST, SPANNING_TOTAL, LARGEST_INDEX = 0, 1, 2


@njit(cache=True, nogil=True)
def flood(order: IntArray, n: int, history: IntArray) -> None:
    """Add nodes one by one and follow the connected components that they form.

    Nodes are joined along the 14 edges of the Freudenthal triangulation, so that components are
    those of the piecewise linear function, for the sublevel and for the superlevel set alike.
    A piece spans when its closed paths wind around the cell in three independent directions. The
    windings form a lattice of integer vectors; its index is 1 when the piece is connected to its
    own copy in every neighbouring cell, and larger when the copies interpenetrate unconnected.

    Parameters
    ----------
    order : (n^3,) int64 array
        Flat C-order node numbers in the order of adding.
    n : int
        Nodes along each axis.
    history : (n^3, 3) int64 array, overwritten
        After each node: size of the largest spanning component, total size of all spanning ones,
        index of the lattice of windings of the largest one (0 while there is none).
    """
    count = n * n * n
    parent = np.full(count, -1, dtype=np.int64)
    jump = np.zeros((count, 3), dtype=np.int32)
    size = np.ones(count, dtype=np.int64)
    windings = np.zeros((count, 3, 3), dtype=np.int32)
    largest = 0
    largest_root = -1
    total = 0
    for step in range(count):
        node = order[step]
        parent[node] = node
        z = node % n
        y = (node // n) % n
        x = node // (n * n)
        for sign in (-1, 1):
            for mask in range(1, 8):
                dx = sign * (mask & 1)
                dy = sign * ((mask >> 1) & 1)
                dz = sign * ((mask >> 2) & 1)
                wx, px = wrap(x + dx, n)
                wy, py = wrap(y + dy, n)
                wz, pz = wrap(z + dz, n)
                neighbour = (px * n + py) * n + pz
                if parent[neighbour] < 0:
                    continue
                a = find(parent, jump, node)
                b = find(parent, jump, neighbour)
                # The copy of `other` that touches `node` lies in cell (wx, wy, wz).
                vx = jump[node, 0] - jump[neighbour, 0] - wx
                vy = jump[node, 1] - jump[neighbour, 1] - wy
                vz = jump[node, 2] - jump[neighbour, 2] - wz
                if a == b:
                    if vx == 0 and vy == 0 and vz == 0:
                        continue
                    before = lattice_index(windings[a])
                    insert(windings[a], vx, vy, vz)
                    after = lattice_index(windings[a])
                    if before == 0 and after > 0:
                        total += size[a]
                        if size[a] > largest:
                            largest, largest_root = size[a], a
                    continue
                if size[a] < size[b]:
                    a, b = b, a
                    vx, vy, vz = -vx, -vy, -vz
                span_a = lattice_index(windings[a]) > 0
                span_b = lattice_index(windings[b]) > 0
                parent[b] = a
                jump[b, 0], jump[b, 1], jump[b, 2] = vx, vy, vz
                for i in range(3):
                    w = windings[b, i]
                    if w[0] != 0 or w[1] != 0 or w[2] != 0:
                        insert(windings[a], np.int64(w[0]), np.int64(w[1]), np.int64(w[2]))
                if span_a:
                    total -= size[a]
                if span_b:
                    total -= size[b]
                size[a] += size[b]
                if lattice_index(windings[a]) > 0:
                    total += size[a]
                    if size[a] >= largest:
                        largest, largest_root = size[a], a
        history[step, LARGEST] = largest
        history[step, SPANNING_TOTAL] = total
        if largest_root >= 0:
            history[step, LARGEST_INDEX] = lattice_index(windings[largest_root])
        else:
            history[step, LARGEST_INDEX] = 0


@njit(cache=True, nogil=True)
def wrap(i: int, n: int) -> tuple[int, int]:
    """Return the cell (-1, 0 or 1) and the place in it of a neighbour's coordinate."""
    if i < 0:
        return -1, i + n
    if i >= n:
        return 1, i - n
    return 0, i


@njit(cache=True, nogil=True)
def find(parent: IntArray, jump: NDArray[np.int32], node: int) -> int:
    """Root of a node; afterwards ``parent`` is the root and ``jump`` leads to it in cells."""
    root = node
    jx, jy, jz = np.int32(0), np.int32(0), np.int32(0)
    while parent[root] != root:
        jx += jump[root, 0]
        jy += jump[root, 1]
        jz += jump[root, 2]
        root = parent[root]
    while parent[node] != root and node != root:
        following = parent[node]
        ox, oy, oz = jump[node, 0], jump[node, 1], jump[node, 2]
        parent[node] = root
        jump[node, 0], jump[node, 1], jump[node, 2] = jx, jy, jz
        jx -= ox
        jy -= oy
        jz -= oz
        node = following
    return root


@njit(cache=True, nogil=True)
def lattice_index(rows: NDArray[np.int32]) -> int:
    """Return the index of a lattice of triangular rows, 0 below three dimensions."""
    return abs(rows[0, 0] * rows[1, 1] * rows[2, 2])


@njit(cache=True, nogil=True)
def insert(rows: NDArray[np.int32], vx: int, vy: int, vz: int) -> None:
    """Add a vector to an integer lattice kept as upper triangular rows, by Euclid's algorithm."""
    v = np.zeros(3, dtype=np.int64)
    v[0], v[1], v[2] = vx, vy, vz
    for i in range(3):
        while v[i] != 0:
            if rows[i, i] == 0:
                rows[i, 0], rows[i, 1], rows[i, 2] = v[0], v[1], v[2]
                return
            q = rows[i, i] // v[i]
            for k in range(3):
                kept = rows[i, k] - q * v[k]
                rows[i, k] = v[k]
                v[k] = kept
        if rows[i, i] < 0:
            for k in range(3):
                rows[i, k] = -rows[i, k]
