"""Compiled kernels: sparsity pattern and element stiffness.

Every row of the stiffness is summed by one thread in a fixed order, so results neither race nor
depend on the number of threads. Elements are straight-sided: the gradients of barycentric
coordinates are constant, and shape functions enter through small tables of the caller: products
of their gradients, or gradients at the vertices where the stiffness varies inside elements.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: Only fused multiply-add. Reordering of sums makes the compiler gather across blocks, 2.6x slower.
FAST = {"contract"}

#: Voigt index of every pair of directions.
VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])

#: Place of an entry of a symmetric 6 by 6 matrix in its upper triangle by rows.
UPPER = np.array(
    [[max(p, q) + (11 - min(p, q)) * min(p, q) // 2 for q in range(6)] for p in range(6)]
)

#: Place of two barycentric coordinates among the moments of a stiffness.
PAIR = np.array([[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]])


#: Elements at every node: start ``(n + 1,)``, element and local node.
Incidence = tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int8]]


@njit(cache=True, nogil=True)
def elements_of_nodes(elements: NDArray[np.int32], n: int) -> Incidence:
    """Elements at every node: start ``(n + 1,)``, element and local node, ``(k * m,)`` each."""
    k, m = elements.shape
    start = np.zeros(n + 1, np.int64)
    for a in range(k):
        for e in range(m):
            start[elements[a, e] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    fill = start[:-1].copy()
    element = np.zeros(k * m, np.int32)
    local = np.zeros(k * m, np.int8)
    for e in range(m):
        for a in range(k):
            p = fill[elements[a, e]]
            element[p] = e
            local[p] = a
            fill[elements[a, e]] = p + 1
    return start, element, local


@njit(cache=True, nogil=True)
def _sort(values: Any, first: int, last: int) -> None:
    """Sort a short slice in place by insertion."""
    for p in range(first + 1, last):
        value = values[p]
        q = p
        while q > first and values[q - 1] > value:
            values[q] = values[q - 1]
            q -= 1
        values[q] = value


@njit(cache=True, nogil=True)
def count_columns(
    low: int, high: int, elements: NDArray[np.int32], incidence: Incidence, row: NDArray[np.int64]
) -> None:
    """Set row[i + 1] to the number of nodes that share an element with node i, of a range."""
    start, element, _ = incidence
    seen = np.full(start.size - 1, -1, np.int32)
    for i in range(low, high):
        count = 0
        for p in range(start[i], start[i + 1]):
            for b in range(elements.shape[0]):
                j = elements[b, element[p]]
                if seen[j] != i:
                    seen[j] = i
                    count += 1
        row[i + 1] = count


@njit(cache=True, nogil=True)
def list_columns(
    low: int,
    high: int,
    elements: NDArray[np.int32],
    incidence: Incidence,
    row: NDArray[np.int64],
    column: NDArray[np.int32],
) -> None:
    """Fill the sorted columns of a range of block rows, whose starts are ``row`` ``(n + 1,)``."""
    start, element, _ = incidence
    seen = np.full(start.size - 1, -1, np.int32)
    for i in range(low, high):
        q = row[i]
        for p in range(start[i], start[i + 1]):
            for b in range(elements.shape[0]):
                j = elements[b, element[p]]
                if seen[j] != i:
                    seen[j] = i
                    column[q] = j
                    q += 1
        _sort(column, row[i], q)


@njit(cache=True, nogil=True)
def _gradients(nodes: Any, elements: Any, e: int, g: Any) -> float:
    """Fill `g` (4, 3) with gradients of barycentric coordinates, 1/mm; return the volume."""
    p0, p1, p2, p3 = elements[0, e], elements[1, e], elements[2, e], elements[3, e]
    x0, y0, z0 = nodes[0, p0], nodes[1, p0], nodes[2, p0]
    a0, a1, a2 = nodes[0, p1] - x0, nodes[1, p1] - y0, nodes[2, p1] - z0
    b0, b1, b2 = nodes[0, p2] - x0, nodes[1, p2] - y0, nodes[2, p2] - z0
    c0, c1, c2 = nodes[0, p3] - x0, nodes[1, p3] - y0, nodes[2, p3] - z0
    u0, u1, u2 = b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0
    det = a0 * u0 + a1 * u1 + a2 * u2
    s = 1.0 / det
    g[1, 0], g[1, 1], g[1, 2] = u0 * s, u1 * s, u2 * s
    g[2, 0] = (c1 * a2 - c2 * a1) * s
    g[2, 1] = (c2 * a0 - c0 * a2) * s
    g[2, 2] = (c0 * a1 - c1 * a0) * s
    g[3, 0] = (a1 * b2 - a2 * b1) * s
    g[3, 1] = (a2 * b0 - a0 * b2) * s
    g[3, 2] = (a0 * b1 - a1 * b0) * s
    for d in range(3):
        g[0, d] = -(g[1, d] + g[2, d] + g[3, d])
    return det / 6.0


@njit(cache=True, nogil=True)
def _unpack(coefficients: Any, scale: float, c: Any) -> None:
    """Fill `c` (6, 6) with `scale` times a stiffness of ``(2,)`` or ``(21,)`` coefficients."""
    if coefficients.size == 2:
        lam = scale * coefficients[0]
        mu = scale * coefficients[1]
        for p in range(3):
            for q in range(3):
                c[p, q] = lam
            c[p, p] += 2.0 * mu
            c[p + 3, p + 3] = mu
    else:
        k = 0
        for p in range(6):
            for q in range(p, 6):
                c[p, q] = scale * coefficients[k]
                c[q, p] = c[p, q]
                k += 1


@njit(cache=True, nogil=True)
def _couple(g: Any, c: Any, u: int, bc: Any, h: Any) -> None:
    """Fill `h` (4, 3, 3) with ``B_u^T C B_v`` for every coordinate v; `bc` is scratch (3, 6)."""
    for x in range(3):
        for y in range(6):
            bc[x, y] = (
                g[u, 0] * c[VOIGT[x, 0], y]
                + g[u, 1] * c[VOIGT[x, 1], y]
                + g[u, 2] * c[VOIGT[x, 2], y]
            )
    for v in range(4):
        for x in range(3):
            h[v, x, 0] = g[v, 0] * bc[x, 0] + g[v, 1] * bc[x, 5] + g[v, 2] * bc[x, 4]
            h[v, x, 1] = g[v, 0] * bc[x, 5] + g[v, 1] * bc[x, 1] + g[v, 2] * bc[x, 3]
            h[v, x, 2] = g[v, 0] * bc[x, 4] + g[v, 1] * bc[x, 3] + g[v, 2] * bc[x, 2]


@njit(fastmath=FAST, cache=True, nogil=True)
def stiffness_blocks(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    coefficients: NDArray[np.float64],
    tables: tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.int8], NDArray[np.float64]],
    incidence: Incidence,
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """Add the stiffness to blocks ``(n_blocks, 3, 3)`` of a range of block rows, N/mm.

    The block of nodes a and b is the weighted sum of ``B_u^T C B_v`` over the barycentric
    coordinates u and v on which their shape functions depend.
    """
    support, count, term, weight = tables
    start, element, local = incidence
    n = row.size - 1
    k = elements.shape[0]
    position = np.zeros(n, np.int32)
    g = np.zeros((4, 3))
    c = np.zeros((6, 6))
    bc = np.zeros((3, 6))
    h = np.zeros((2, 4, 3, 3))
    for i in range(low, high):
        for p in range(row[i], row[i + 1]):
            position[column[p]] = p
        for p in range(start[i], start[i + 1]):
            e = np.int64(element[p])
            a = local[p]
            volume = _gradients(nodes, elements, e, g)
            _unpack(coefficients[e], volume, c)
            for s in range(2):
                if support[a, s] >= 0:
                    _couple(g, c, support[a, s], bc, h[s])
            for b in range(k):
                q = position[elements[b, e]]
                for t in range(count[a, b]):
                    w = weight[a, b, t]
                    s = term[a, b, t, 0]
                    v = term[a, b, t, 1]
                    for x in range(3):
                        for y in range(3):
                            blocks[q, x, y] += w * h[s, v, x, y]


@njit(cache=True, nogil=True, inline="always")
def _add_coupled(moments: Any, e: int, pair: int, s: Any, bc: Any) -> None:
    """Add ``B^T C`` to `bc` (3, 6), of a shape function with gradient `s` and one moment of C."""
    for y in range(6):
        c3 = moments[e, pair, UPPER[3, y]]
        c4 = moments[e, pair, UPPER[4, y]]
        c5 = moments[e, pair, UPPER[5, y]]
        bc[0, y] += s[0] * moments[e, pair, UPPER[0, y]] + s[1] * c5 + s[2] * c4
        bc[1, y] += s[0] * c5 + s[1] * moments[e, pair, UPPER[1, y]] + s[2] * c3
        bc[2, y] += s[0] * c4 + s[1] * c3 + s[2] * moments[e, pair, UPPER[2, y]]


@njit(fastmath=FAST, cache=True, nogil=True)
def stiffness_blocks_of_moments(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    moments: NDArray[np.float64],
    tables: tuple[NDArray[np.float64], NDArray[np.int8]],
    incidence: Incidence,
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """As `stiffness_blocks`, of a stiffness that varies inside elements, N/mm.

    `moments` ``(m, 10, 21)`` are those of `MomentStiffness`. B is the sum of its values at the
    vertices times the barycentric coordinates; there a shape function depends on one coordinate at
    most: `tables` are its derivative by that ``(4, k)``, and the coordinate ``(4, k)``. Upper
    triangles are read as they are: unpacked matrices took 1.6 times as long.
    """
    weight, along = tables
    start, element, local = incidence
    n = row.size - 1
    k = elements.shape[0]
    position = np.zeros(n, np.int32)
    g = np.zeros((4, 3))
    bc = np.zeros((3, 6))
    sums = np.zeros((k, 3, 3))
    for i in range(low, high):
        for p in range(row[i], row[i + 1]):
            position[column[p]] = p
        for p in range(start[i], start[i + 1]):
            e = np.int64(element[p])
            a = local[p]
            volume = _gradients(nodes, elements, e, g)
            for b in range(k):
                for x in range(3):
                    for y in range(3):
                        sums[b, x, y] = 0.0
            for t in range(4):
                for x in range(3):
                    for y in range(6):
                        bc[x, y] = 0.0
                for s in range(4):
                    w = weight[s, a] * volume
                    if w != 0.0:
                        u = along[s, a]
                        slope = (w * g[u, 0], w * g[u, 1], w * g[u, 2])
                        _add_coupled(moments, e, PAIR[s, t], slope, bc)
                for b in range(k):
                    w = weight[t, b]
                    if w == 0.0:
                        continue
                    v = along[t, b]
                    s0, s1, s2 = w * g[v, 0], w * g[v, 1], w * g[v, 2]
                    for x in range(3):
                        sums[b, x, 0] += s0 * bc[x, 0] + s1 * bc[x, 5] + s2 * bc[x, 4]
                        sums[b, x, 1] += s0 * bc[x, 5] + s1 * bc[x, 1] + s2 * bc[x, 3]
                        sums[b, x, 2] += s0 * bc[x, 4] + s1 * bc[x, 3] + s2 * bc[x, 2]
            for b in range(k):
                j = position[elements[b, e]]
                for x in range(3):
                    for y in range(3):
                        blocks[j, x, y] += sums[b, x, y]
