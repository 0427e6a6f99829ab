"""Compiled element stiffness of isotropic material, a third of the work of a full tensor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.mechanics.fe._assembly_kernels import FAST, Incidence, _gradients


@njit(fastmath=FAST, cache=True, nogil=True)
def _add_block(
    block: Any, q: int, lam: float, mu: float, p: Any, m0: float, m1: float, m2: float
) -> None:
    """Add ``lam p m^T + mu (m p^T + p.m I)`` to a block."""
    p0, p1, p2 = p[0], p[1], p[2]
    l0, l1, l2 = lam * p0, lam * p1, lam * p2
    u0, u1, u2 = mu * p0, mu * p1, mu * p2
    d = u0 * m0 + u1 * m1 + u2 * m2
    block[q, 0, 0] += d + (l0 + u0) * m0
    block[q, 0, 1] += l0 * m1 + u1 * m0
    block[q, 0, 2] += l0 * m2 + u2 * m0
    block[q, 1, 0] += l1 * m0 + u0 * m1
    block[q, 1, 1] += d + (l1 + u1) * m1
    block[q, 1, 2] += l1 * m2 + u2 * m1
    block[q, 2, 0] += l2 * m0 + u0 * m2
    block[q, 2, 1] += l2 * m1 + u1 * m2
    block[q, 2, 2] += d + (l2 + u2) * m2


@njit(fastmath=FAST, cache=True, nogil=True)
def isotropic_blocks(
    low: int,
    high: int,
    nodes: NDArray[np.float64],
    elements: NDArray[np.int32],
    lame: NDArray[np.float64],
    tables: tuple[NDArray[np.int8], NDArray[np.int8], NDArray[np.int8], NDArray[np.float64]],
    incidence: Incidence,
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[np.float64],
) -> None:
    """`stiffness_blocks` for Lame's two constants ``(m, 2)`` of every element, MPa."""
    support, count, term, weight = tables
    start, element, local = incidence
    n = row.size - 1
    k = elements.shape[0]
    position = np.zeros(n, np.int32)
    g = np.zeros((4, 3))
    for i in range(low, high):
        for p in range(row[i], row[i + 1]):
            position[column[p]] = p
        for p in range(start[i], start[i + 1]):
            e = np.int64(element[p])
            a = local[p]
            volume = _gradients(nodes, elements, e, g)
            lam, mu = volume * lame[e, 0], volume * lame[e, 1]
            for b in range(k):
                q = position[elements[b, e]]
                x0, x1, x2, y0, y1, y2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for t in range(count[a, b]):
                    w = weight[a, b, t]
                    v = term[a, b, t, 1]
                    if term[a, b, t, 0] == 0:
                        x0 += w * g[v, 0]
                        x1 += w * g[v, 1]
                        x2 += w * g[v, 2]
                    else:
                        y0 += w * g[v, 0]
                        y1 += w * g[v, 1]
                        y2 += w * g[v, 2]
                _add_block(blocks, q, lam, mu, g[support[a, 0]], x0, x1, x2)
                if support[a, 1] >= 0:
                    _add_block(blocks, q, lam, mu, g[support[a, 1]], y0, y1, y2)
