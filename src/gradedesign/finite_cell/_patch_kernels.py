"""Inverted stiffness of small groups of weakly held nodes, applied as an additive smoother."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange


@njit(parallel=True, cache=True, nogil=True)
def assemble_patches(
    weak: Any, nodes: Any, chosen: Any, row_of: Any, first: Any, near: Any, matrices: Any,
    offsets: Any, out: Any,
) -> None:  # fmt: skip
    """Stiffness of the weak nodes of every chosen element, all elements around them included.

    Parameters
    ----------
    weak : (N,) bool array
    nodes : (n, 27) int32 array
    chosen : (k,) int array
        Elements with weak nodes.
    row_of : (n,) int array
        Row of every element in `matrices`, -1 where it has no weak node.
    first, near : int arrays
        Elements of every weak node (empty for the others).
    matrices : (k, 81, 81) array
    offsets : (k + 1,) int array
        Of every patch in `out`.
    out : (total,) array
        Written: symmetric matrices, unknowns in the order of the element's weak nodes.
    """
    for r in prange(chosen.size):
        e = chosen[r]
        local = np.zeros(27, np.int64)
        size = 0
        for a in range(27):
            if weak[nodes[e, a]]:
                local[size] = a
                size += 1
        width = 3 * size
        begin = offsets[r]
        for i in range(size):
            ni = nodes[e, local[i]]
            for j in range(size):
                nj = nodes[e, local[j]]
                for q in range(first[ni], first[ni + 1]):
                    other = near[q]
                    ai = -1
                    aj = -1
                    for a in range(27):
                        if nodes[other, a] == ni:
                            ai = a
                        if nodes[other, a] == nj:
                            aj = a
                    if aj < 0:
                        continue
                    m = row_of[other]
                    for c in range(3):
                        at = begin + (3 * i + c) * width + 3 * j
                        for d in range(3):
                            out[at + d] += matrices[m, 3 * ai + c, 3 * aj + d]


@njit(parallel=True, fastmath=True, cache=True, nogil=True)
def add_patches(
    weak: Any, nodes: Any, chosen: Any, colours: Any, offsets: Any, inverse: Any, scale: Any,
    r: Any, z: Any,
) -> None:  # fmt: skip
    """Add the scaled patch solutions of the residual r to z; both are ``(N, 3)``."""
    for c in range(8):
        for p in prange(colours[c], colours[c + 1]):
            e = chosen[p]
            f = np.zeros(81, r.dtype)
            local = np.zeros(27, np.int64)
            size = 0
            for a in range(27):
                n = nodes[e, a]
                if weak[n]:
                    local[size] = n
                    for d in range(3):
                        f[3 * size + d] = r[n, d]
                    size += 1
            width = 3 * size
            begin = offsets[p]
            for i in range(size):
                for d in range(3):
                    at = begin + (3 * i + d) * width
                    total = r.dtype.type(0)
                    for j in range(width):
                        total += inverse[at + j] * f[j]
                    z[local[i], d] += scale * total


@njit(parallel=True, fastmath=True, cache=True, nogil=True)
def block_jacobi(inverse: Any, f: Any, y: Any, r: Any, z: Any) -> None:
    """Set r = f - y and z = D^-1 r with 3 by 3 blocks."""
    for i in prange(r.shape[0]):
        for c in range(3):
            r[i, c] = f[i, c] - y[i, c]
        for c in range(3):
            z[i, c] = inverse[i, c, 0] * r[i, 0] + inverse[i, c, 1] * r[i, 1] + (
                inverse[i, c, 2] * r[i, 2]
            )


@njit(parallel=True, fastmath=True, cache=True, nogil=True)
def step_along(momentum: Any, step: Any, z: Any, d: Any, x: Any) -> None:
    """d = momentum d + step z, x += d."""
    for i in prange(x.shape[0]):
        for c in range(3):
            d[i, c] = momentum * d[i, c] + step * z[i, c]
            x[i, c] += d[i, c]


@njit(parallel=True, fastmath=True, cache=True, nogil=True)
def masked_residual(keep: Any, f: Any, y: Any) -> None:
    """Set y to keep (f - y)."""
    for i in prange(y.shape[0]):
        for c in range(3):
            y[i, c] = keep[i, c] * (f[i, c] - y[i, c])
