"""Coarser elements of eight: which parts stay apart, their nodes, stiffness and block rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gradedesign.mechanics.finite_cell._node_kernels import join, root_of


@njit(cache=True, nogil=True)
def elements_of_nodes(nodes: Any, count: int) -> tuple[Any, Any, Any]:
    """List the elements of every node: first of each node, elements, local numbers."""
    first = np.zeros(count + 1, np.int64)
    n, m = nodes.shape
    for e in range(n):
        for a in range(m):
            first[nodes[e, a] + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    place = first[:-1].copy()
    element = np.zeros(n * m, np.int32)
    local = np.zeros(n * m, np.int8)
    for e in range(n):
        for a in range(m):
            i = nodes[e, a]
            element[place[i]] = e
            local[place[i]] = a
            place[i] += 1
    return first, element, local


@njit(cache=True, nogil=True)
def _numbered(parent: Any, out: Any) -> int:
    """Number the sets in the order of their first members; returns how many."""
    number = np.full(parent.size, -1, np.int32)
    count = 0
    for i in range(parent.size):
        r = root_of(parent, i)
        if number[r] < 0:
            number[r] = count
            count += 1
        out[i] = number[r]
    return count


@njit(cache=True, nogil=True)
def connected_copies(parent: Any, first: Any, element: Any, copy: Any) -> int:
    """Number the coarse elements: children of one parent that share no node become two copies.

    Parameters
    ----------
    parent : (n,) int array
        Coarse place of every element.
    first, element : int arrays
        Of `elements_of_nodes`.
    copy : (n,) int32 array
        Written: coarse element of every element.

    Returns
    -------
    int
        Number of coarse elements.
    """
    sets = np.arange(copy.size, dtype=np.int32)
    for i in range(first.size - 1):
        for q in range(first[i], first[i + 1]):
            for r in range(first[i], q):
                if parent[element[q]] == parent[element[r]]:
                    join(sets, np.int64(element[q]), np.int64(element[r]))
    return _numbered(sets, copy)


@njit(cache=True, nogil=True)
def coarse_nodes(copy: Any, place: Any, first: Any, element: Any, nodes: Any) -> int:
    """Number the corners of coarse elements: one where their copies share a finer node.

    Parameters
    ----------
    copy : (n,) int32 array
        Coarse element of every element.
    place : (m, 3) int array
        Of every coarse element.
    first, element : int arrays
        Of `elements_of_nodes`.
    nodes : (m, 8) int32 array
        Written.

    Returns
    -------
    int
        Number of coarse nodes.
    """
    m = nodes.shape[0]
    sets = np.arange(8 * m, dtype=np.int32)
    for i in range(first.size - 1):
        for q in range(first[i], first[i + 1]):
            a = copy[element[q]]
            for r in range(first[i], q):
                b = copy[element[r]]
                if a == b:
                    continue
                dx = place[b, 0] - place[a, 0]
                dy = place[b, 1] - place[a, 1]
                dz = place[b, 2] - place[a, 2]
                for c in range(8):
                    x = (c & 1) - dx
                    y = ((c >> 1) & 1) - dy
                    z = (c >> 2) - dz
                    if 0 <= x <= 1 and 0 <= y <= 1 and 0 <= z <= 1:
                        join(sets, 8 * np.int64(a) + c, 8 * np.int64(b) + x + 2 * y + 4 * z)
    flat = np.zeros(8 * m, np.int32)
    count = _numbered(sets, flat)
    for p in range(m):
        for c in range(8):
            nodes[p, c] = flat[8 * p + c]
    return count


@njit(cache=True, nogil=True)
def add_children(
    low: int, high: int, child: Any, first: Any, slot: Any, keep: Any, nodes: Any, fine: Any,
    weights: Any, coarse: Any,
) -> None:  # fmt: skip
    """Sum the Galerkin products of the children of every coarse element.

    Parameters
    ----------
    low, high : int
        Range of coarse elements.
    child, first : int arrays
        Children of every coarse element, and the first of each.
    slot : (n,) int array
        Corner of the parent in which every element lies.
    keep : (N, 3) float32 array
        0 where a component is fixed.
    nodes : (n, 8) int32 array
        Of the elements.
    fine : (n, 24, 24) float32 array
    weights : (8, 8, 8) float32 array
        [slot, corner of the child, corner of the parent].
    coarse : (m, 24, 24) float32 array
        Written.
    """
    half = np.zeros((24, 24), np.float32)
    total = np.zeros((24, 24), np.float32)
    for p in range(low, high):
        for r in range(24):
            for j in range(24):
                total[r, j] = 0
        for q in range(first[p], first[p + 1]):
            e = child[q]
            w = weights[slot[e]]
            for r in range(24):
                for j in range(24):
                    half[r, j] = 0
            for a in range(8):
                for i in range(3):
                    s = keep[nodes[e, a], i]
                    if s == 0:
                        continue
                    for b in range(8):
                        wab = w[a, b]
                        if wab != 0:
                            for j in range(24):
                                half[3 * b + i, j] += wab * fine[e, 3 * a + i, j]
            for a in range(8):
                for j in range(3):
                    if keep[nodes[e, a], j] == 0:
                        continue
                    for b in range(8):
                        wab = w[a, b]
                        if wab != 0:
                            for r in range(24):
                                total[r, 3 * b + j] += wab * half[r, 3 * a + j]
        for r in range(24):
            for j in range(24):
                coarse[p, r, j] = total[r, j]


@njit(cache=True, nogil=True)
def count_columns(low: int, high: int, nodes: Any, first: Any, element: Any, size: Any) -> None:
    """Set size[i + 1] to the number of nodes that share an element with node i, of a range."""
    columns = np.zeros(27 * nodes.shape[1], np.int32)
    for i in range(low, high):
        k = 0
        for q in range(first[i], first[i + 1]):
            for b in range(nodes.shape[1]):
                j = nodes[element[q], b]
                known = False
                for z in range(k):
                    if columns[z] == j:
                        known = True
                        break
                if not known:
                    if k == columns.size:
                        wider = np.zeros(2 * k, np.int32)
                        for z in range(k):
                            wider[z] = columns[z]
                        columns = wider
                    columns[k] = j
                    k += 1
        size[i + 1] = k


@njit(cache=True, nogil=True)
def fill_rows(
    low: int, high: int, nodes: Any, matrices: Any, first: Any, element: Any, local: Any, row: Any,
    column: Any, blocks: Any,
) -> None:  # fmt: skip
    """Add 3 by 3 blocks of element matrices to a range of block rows, and name their columns."""
    m = nodes.shape[1]
    for i in range(low, high):
        s = row[i]
        k = 0
        for q in range(first[i], first[i + 1]):
            e = element[q]
            a = local[q]
            for b in range(m):
                j = nodes[e, b]
                at = k
                for z in range(k):
                    if column[s + z] == j:
                        at = z
                        break
                if at == k:
                    column[s + k] = j
                    k += 1
                for c in range(3):
                    for d in range(3):
                        blocks[s + at, c, d] += matrices[e, 3 * a + c, 3 * b + d]
