"""Compiled kernels of the multigrid solver: products with block-sparse matrices, smoothing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

#: Only fused multiply-add. Reordering of sums makes the compiler gather across blocks, 2.6x slower.
FAST = {"contract"}


@njit(parallel=True, fastmath=FAST, cache=True)
def multiply(
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[Any],
    x: NDArray[Any],
    keep: NDArray[Any],
    add: float,
    y: NDArray[Any],
) -> None:
    """Set ``y = add * y + keep * (A x)`` for a matrix A of dense blocks.

    Parameters
    ----------
    row, column : int32 arrays
        Block rows and block columns in compressed form.
    blocks : (n_blocks, r, c) array
        One by one blocks act on all three components of a node alike.
    x, keep, y : arrays of the type of `blocks`
    add : float
    """
    r = blocks.shape[1]
    c = blocks.shape[2]
    zero = blocks.dtype.type(0)
    scale = blocks.dtype.type(add)
    for i in prange(row.size - 1):
        if r == 3 and c == 3:
            s0 = zero
            s1 = zero
            s2 = zero
            for p in range(row[i], row[i + 1]):
                j = 3 * column[p]
                b = blocks[p]
                x0, x1, x2 = x[j], x[j + 1], x[j + 2]
                s0 += b[0, 0] * x0 + b[0, 1] * x1 + b[0, 2] * x2
                s1 += b[1, 0] * x0 + b[1, 1] * x1 + b[1, 2] * x2
                s2 += b[2, 0] * x0 + b[2, 1] * x1 + b[2, 2] * x2
            k = 3 * i
            y[k] = scale * y[k] + keep[k] * s0
            y[k + 1] = scale * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = scale * y[k + 2] + keep[k + 2] * s2
        elif r == 1 and c == 1:
            s0 = zero
            s1 = zero
            s2 = zero
            for p in range(row[i], row[i + 1]):
                j = 3 * column[p]
                w = blocks[p, 0, 0]
                s0 += w * x[j]
                s1 += w * x[j + 1]
                s2 += w * x[j + 2]
            k = 3 * i
            y[k] = scale * y[k] + keep[k] * s0
            y[k + 1] = scale * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = scale * y[k + 2] + keep[k + 2] * s2
        else:
            for a in range(r):
                s0 = zero
                for p in range(row[i], row[i + 1]):
                    for b2 in range(c):
                        s0 += blocks[p, a, b2] * x[c * column[p] + b2]
                k = r * i + a
                y[k] = scale * y[k] + keep[k] * s0
