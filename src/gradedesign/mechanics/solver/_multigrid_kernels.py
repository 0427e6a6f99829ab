"""Compiled kernels of the multigrid solver: products with block-sparse matrices, smoothing.

Small problems run on one thread: starting several costs more than it saves below a millisecond of
work, and far more when other programs keep the processors busy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.common.system.threads import in_ranges

#: Only fused multiply-add. Reordering of sums makes the compiler gather across blocks, 2.6x slower.
FAST = {"contract"}
#: Matrix entries from which threads pay: a millisecond of memory. Chosen, not measured.
THREADED = 3_000_000


def multiply(
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[Any],
    x: NDArray[Any],
    keep: NDArray[Any],
    add: float,
    y: NDArray[Any],
) -> None:
    """Set ``y = add * y + keep * (A x)`` for a matrix A of dense blocks and every vector of x.

    Vectors go two at a time through large 3 by 3 blocks: memory gives the blocks no faster than
    one processor multiplies them, so the second vector costs little.

    Parameters
    ----------
    row, column : int32 arrays
        Block rows and block columns in compressed form.
    blocks : (n_blocks, r, c) array
        3 by c or 6 by c; one by one blocks act on all three components of a node alike.
    x, y : (n,) or (k, n) arrays of the type of `blocks`
    keep : (n,) array of the type of `blocks`
    """
    if x.ndim == 1:
        x, y = x[None], y[None]
    threaded = blocks.size >= THREADED
    scale = blocks.dtype.type(add)
    rows = range(row.size - 1)
    paired = 2 * (len(x) // 2) if blocks.shape[1:] == (3, 3) else 0
    for k in range(0, paired, 2):
        in_ranges(
            _multiply_pair, rows, row, column, blocks, x[k], x[k + 1], keep, scale, y[k], y[k + 1],
            threaded=threaded,
        )  # fmt: skip
    for k in range(paired, len(x)):
        in_ranges(_multiply, rows, row, column, blocks, x[k], keep, scale, y[k], threaded=threaded)


def relax(
    inverse: NDArray[np.float32],
    f: NDArray[np.float32],
    y: NDArray[np.float32],
    momentum: float,
    step: float,
    d: NDArray[np.float32],
    x: NDArray[np.float32],
) -> None:
    """One step of Chebyshev's iteration: ``d = momentum d + step D^-1 (f - y)``, ``x += d``.

    `inverse` holds the inverses ``(n, b, b)`` of the diagonal blocks, zero where fixed. Vectors
    are ``(n,)`` or ``(k, n)``.
    """
    threaded = inverse.size >= THREADED // 4
    if x.ndim == 1:
        f, y, d, x = f[None], y[None], d[None], x[None]
    for k in range(len(x)):
        in_ranges(
            _relax, range(len(inverse)), inverse, f[k], y[k], np.float32(momentum),
            np.float32(step), d[k], x[k], threaded=threaded,
        )  # fmt: skip


@njit(fastmath=FAST, cache=True, nogil=True)
def _multiply(
    low: int, high: int, row: Any, column: Any, blocks: Any, x: Any, keep: Any, add: Any, y: Any
) -> None:
    """A range of block rows of `multiply`."""
    r = blocks.shape[1]
    c = blocks.shape[2]
    zero = blocks.dtype.type(0)
    for i in range(low, high):
        k = r * i
        if r == 3 and c == 3:
            s0, s1, s2 = zero, zero, zero
            for p in range(row[i], row[i + 1]):
                j = 3 * column[p]
                u, v, w = x[j], x[j + 1], x[j + 2]
                s0 += blocks[p, 0, 0] * u + blocks[p, 0, 1] * v + blocks[p, 0, 2] * w
                s1 += blocks[p, 1, 0] * u + blocks[p, 1, 1] * v + blocks[p, 1, 2] * w
                s2 += blocks[p, 2, 0] * u + blocks[p, 2, 1] * v + blocks[p, 2, 2] * w
            y[k] = add * y[k] + keep[k] * s0
            y[k + 1] = add * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = add * y[k + 2] + keep[k + 2] * s2
        elif r == 1 and c == 1:
            s0, s1, s2 = zero, zero, zero
            for p in range(row[i], row[i + 1]):
                j = 3 * column[p]
                weight = blocks[p, 0, 0]
                s0 += weight * x[j]
                s1 += weight * x[j + 1]
                s2 += weight * x[j + 2]
            k = 3 * i
            y[k] = add * y[k] + keep[k] * s0
            y[k + 1] = add * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = add * y[k + 2] + keep[k + 2] * s2
        elif r == 3:
            s0, s1, s2 = zero, zero, zero
            for p in range(row[i], row[i + 1]):
                j = c * column[p]
                for b in range(c):
                    u = x[j + b]
                    s0 += blocks[p, 0, b] * u
                    s1 += blocks[p, 1, b] * u
                    s2 += blocks[p, 2, b] * u
            y[k] = add * y[k] + keep[k] * s0
            y[k + 1] = add * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = add * y[k + 2] + keep[k + 2] * s2
        else:
            # Blocks of six rows: six sums that wait for nothing but themselves stay in registers.
            s0, s1, s2, s3, s4, s5 = zero, zero, zero, zero, zero, zero
            for p in range(row[i], row[i + 1]):
                j = c * column[p]
                for b in range(c):
                    u = x[j + b]
                    s0 += blocks[p, 0, b] * u
                    s1 += blocks[p, 1, b] * u
                    s2 += blocks[p, 2, b] * u
                    s3 += blocks[p, 3, b] * u
                    s4 += blocks[p, 4, b] * u
                    s5 += blocks[p, 5, b] * u
            y[k] = add * y[k] + keep[k] * s0
            y[k + 1] = add * y[k + 1] + keep[k + 1] * s1
            y[k + 2] = add * y[k + 2] + keep[k + 2] * s2
            y[k + 3] = add * y[k + 3] + keep[k + 3] * s3
            y[k + 4] = add * y[k + 4] + keep[k + 4] * s4
            y[k + 5] = add * y[k + 5] + keep[k + 5] * s5


@njit(fastmath=FAST, cache=True, nogil=True)
def _multiply_pair(
    low: int, high: int, row: Any, column: Any, blocks: Any, xs: Any, xt: Any, keep: Any, add: Any,
    ys: Any, yt: Any,
) -> None:  # fmt: skip
    """A range of rows of 3 by 3 blocks of `multiply`, for two vectors."""
    zero = blocks.dtype.type(0)
    for i in range(low, high):
        s0, s1, s2 = zero, zero, zero
        t0, t1, t2 = zero, zero, zero
        for p in range(row[i], row[i + 1]):
            j = 3 * column[p]
            u, v, w = xs[j], xs[j + 1], xs[j + 2]
            e, f, g = xt[j], xt[j + 1], xt[j + 2]
            a, b, c = blocks[p, 0, 0], blocks[p, 0, 1], blocks[p, 0, 2]
            s0 += a * u + b * v + c * w
            t0 += a * e + b * f + c * g
            a, b, c = blocks[p, 1, 0], blocks[p, 1, 1], blocks[p, 1, 2]
            s1 += a * u + b * v + c * w
            t1 += a * e + b * f + c * g
            a, b, c = blocks[p, 2, 0], blocks[p, 2, 1], blocks[p, 2, 2]
            s2 += a * u + b * v + c * w
            t2 += a * e + b * f + c * g
        k = 3 * i
        ys[k] = add * ys[k] + keep[k] * s0
        ys[k + 1] = add * ys[k + 1] + keep[k + 1] * s1
        ys[k + 2] = add * ys[k + 2] + keep[k + 2] * s2
        yt[k] = add * yt[k] + keep[k] * t0
        yt[k + 1] = add * yt[k + 1] + keep[k + 1] * t1
        yt[k + 2] = add * yt[k + 2] + keep[k + 2] * t2


@njit(fastmath=FAST, cache=True, nogil=True)
def _relax(
    low: int, high: int, inverse: Any, f: Any, y: Any, momentum: Any, step: Any, d: Any, x: Any
) -> None:
    """A range of block rows of `relax`; rows of three, most of them, stay in registers."""
    b = inverse.shape[1]
    for i in range(low, high):
        k = b * i
        if b == 3:
            u, v, w = f[k] - y[k], f[k + 1] - y[k + 1], f[k + 2] - y[k + 2]
            s = inverse[i, 0, 0] * u + inverse[i, 0, 1] * v + inverse[i, 0, 2] * w
            t = inverse[i, 1, 0] * u + inverse[i, 1, 1] * v + inverse[i, 1, 2] * w
            r = inverse[i, 2, 0] * u + inverse[i, 2, 1] * v + inverse[i, 2, 2] * w
            u, v, w = d[k], d[k + 1], d[k + 2]
            u, v, w = momentum * u + step * s, momentum * v + step * t, momentum * w + step * r
            d[k], d[k + 1], d[k + 2] = u, v, w
            x[k] += u
            x[k + 1] += v
            x[k + 2] += w
            continue
        for m in range(b):
            total = np.float32(0.0)
            for c in range(b):
                total += inverse[i, m, c] * (f[k + c] - y[k + c])
            d[k + m] = momentum * d[k + m] + step * total
        for m in range(b):
            x[k + m] += d[k + m]


@njit(cache=True, nogil=True)
def inverse_diagonal(
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[np.float64],
    keep: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Invert the diagonal blocks over the free unknowns; zero rows and columns elsewhere.

    Gauss-Jordan sweeps skip pivots that vanish, which leaves a generalised inverse for blocks of
    deficient rank (an aggregate of two nodes cannot turn about the line through them).
    """
    n = row.size - 1
    b = blocks.shape[1]
    inverse = np.zeros((n, b, b), np.float32)
    a = np.zeros((b, b))
    used = np.zeros(b, np.bool_)
    for i in range(n):
        for r in range(b):
            for c in range(b):
                a[r, c] = 0.0
        for p in range(row[i], row[i + 1]):
            if column[p] == i:
                for r in range(b):
                    for c in range(b):
                        a[r, c] = blocks[p, r, c] * keep[b * i + r] * keep[b * i + c]
        scale = 0.0
        for r in range(b):
            scale = max(scale, a[r, r])
        for k in range(b):
            pivot = a[k, k]
            used[k] = pivot > 1e-9 * scale
            if not used[k]:
                continue
            a[k, k] = 1.0
            for c in range(b):
                a[k, c] /= pivot
            for r in range(b):
                if r != k:
                    factor = a[r, k]
                    a[r, k] = 0.0
                    for c in range(b):
                        a[r, c] -= factor * a[k, c]
        for r in range(b):
            for c in range(b):
                if used[r] and used[c]:
                    inverse[i, r, c] = a[r, c]
    return inverse
