"""Compiled block Gauss-Seidel sweeps over half of a symmetric matrix of 3 by 3 blocks.

Nodes are cut into pieces of consecutive nodes whose number does not depend on the threads. Inside a
piece the lower triangle alone is stored: a row is read once, multiplied with what lies before it
and, transposed, passed on to it. Between pieces rows are stored whole and take the values from
before the sweep (hybrid Gauss-Seidel).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

#: Only fused multiply-add, as in the products.
FAST = {"contract"}

#: Inner rows: start ``(n + 1,)``, columns and blocks of the lower triangle inside pieces.
#: Outer rows: the same of the blocks that couple to other pieces.
Rows = tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]


@njit(cache=True, nogil=True)
def split_rows(
    row: NDArray[np.int32],
    column: NDArray[np.int32],
    blocks: NDArray[np.float64],
    keep: NDArray[np.float64],
    order: NDArray[np.int32],
    pieces: NDArray[np.int64],
) -> tuple[Rows, Rows, NDArray[np.float64], NDArray[np.float32]]:
    """Split a renumbered symmetric matrix into inner, outer and diagonal blocks.

    Parameters
    ----------
    row, column, blocks : arrays
        Block rows, both triangles, 3 by 3 blocks.
    keep : (3 n,) array
        0 on fixed unknowns, whose rows and columns become zero; 1 elsewhere.
    order : (n,) int32 array
        Node at every new place.
    pieces : (k + 1,) array
        First place of every piece, and n.

    Returns
    -------
    inner, outer : tuple of arrays
        Start, column and blocks of compressed rows, in new places.
    diagonal : (n, 3, 3) array
        In new places, with rows and columns of fixed unknowns.
    weakest : (3 n,) float32 array
        Half the row sums of the magnitudes of `outer`.
    """
    n = row.size - 1
    place = np.zeros(n, np.int32)
    piece = np.zeros(n, np.int32)
    for k in range(n):
        place[order[k]] = k
    for c in range(pieces.size - 1):
        for k in range(pieces[c], pieces[c + 1]):
            piece[k] = c
    inner_row = np.zeros(n + 1, np.int32)
    outer_row = np.zeros(n + 1, np.int32)
    for k in range(n):
        inner, outer = 0, 0
        for p in range(row[order[k]], row[order[k] + 1]):
            j = place[column[p]]
            if piece[j] != piece[k]:
                outer += 1
            elif j < k:
                inner += 1
        inner_row[k + 1] = inner_row[k] + inner
        outer_row[k + 1] = outer_row[k] + outer
    inner_column = np.zeros(inner_row[n], np.int32)
    inner_blocks = np.zeros((inner_row[n], 3, 3), np.float32)
    outer_column = np.zeros(outer_row[n], np.int32)
    outer_blocks = np.zeros((outer_row[n], 3, 3), np.float32)
    diagonal = np.zeros((n, 3, 3))
    weakest = np.zeros(3 * n, np.float32)
    for k in range(n):
        i = order[k]
        q, s = inner_row[k], outer_row[k]
        for p in range(row[i], row[i + 1]):
            j = place[column[p]]
            if piece[j] != piece[k]:
                outer_column[s] = j
                for a in range(3):
                    for b in range(3):
                        value = blocks[p, a, b] * keep[3 * i + a] * keep[3 * column[p] + b]
                        outer_blocks[s, a, b] = value
                        weakest[3 * k + a] += 0.5 * abs(value)
                s += 1
            elif j < k:
                # Ascending columns: shift what is larger, mostly little.
                t = q
                while t > inner_row[k] and inner_column[t - 1] > j:
                    inner_column[t] = inner_column[t - 1]
                    for a in range(3):
                        for b in range(3):
                            inner_blocks[t, a, b] = inner_blocks[t - 1, a, b]
                    t -= 1
                inner_column[t] = j
                for a in range(3):
                    for b in range(3):
                        inner_blocks[t, a, b] = (
                            blocks[p, a, b] * keep[3 * i + a] * keep[3 * column[p] + b]
                        )
                q += 1
            elif j == k:
                for a in range(3):
                    for b in range(3):
                        diagonal[k, a, b] = blocks[p, a, b]
    return (
        (inner_row, inner_column, inner_blocks),
        (outer_row, outer_column, outer_blocks),
        diagonal,
        weakest,
    )


@njit(fastmath=FAST, cache=True, nogil=True)
def sweep_forward(
    low: int, high: int, pieces: Any, inner: Any, inverse: Any, f: Any, x: Any, y: Any
) -> None:
    """Sweep a range of pieces from zero; y becomes minus their upper triangles times x."""
    row, column, blocks = inner
    for q in range(low, high):
        for c in range(f.shape[0]):
            for k in range(3 * pieces[q], 3 * pieces[q + 1]):
                y[c, k] = 0.0
        for i in range(pieces[q], pieces[q + 1]):
            k = 3 * i
            for c in range(f.shape[0]):
                s, t, r = f[c, k], f[c, k + 1], f[c, k + 2]
                for p in range(row[i], row[i + 1]):
                    j = 3 * column[p]
                    u, v, w = x[c, j], x[c, j + 1], x[c, j + 2]
                    s -= blocks[p, 0, 0] * u + blocks[p, 0, 1] * v + blocks[p, 0, 2] * w
                    t -= blocks[p, 1, 0] * u + blocks[p, 1, 1] * v + blocks[p, 1, 2] * w
                    r -= blocks[p, 2, 0] * u + blocks[p, 2, 1] * v + blocks[p, 2, 2] * w
                u = inverse[i, 0, 0] * s + inverse[i, 0, 1] * t + inverse[i, 0, 2] * r
                v = inverse[i, 1, 0] * s + inverse[i, 1, 1] * t + inverse[i, 1, 2] * r
                w = inverse[i, 2, 0] * s + inverse[i, 2, 1] * t + inverse[i, 2, 2] * r
                x[c, k], x[c, k + 1], x[c, k + 2] = u, v, w
                for p in range(row[i], row[i + 1]):
                    j = 3 * column[p]
                    y[c, j] -= blocks[p, 0, 0] * u + blocks[p, 1, 0] * v + blocks[p, 2, 0] * w
                    y[c, j + 1] -= blocks[p, 0, 1] * u + blocks[p, 1, 1] * v + blocks[p, 2, 1] * w
                    y[c, j + 2] -= blocks[p, 0, 2] * u + blocks[p, 1, 2] * v + blocks[p, 2, 2] * w


@njit(fastmath=FAST, cache=True, nogil=True)
def sweep_backward(
    low: int, high: int, pieces: Any, inner: Any, inverse: Any, x: Any, y: Any
) -> None:
    """Sweep a range of pieces downwards from x, in place; y, its right-hand side, is used up.

    Blocks are read downwards too: the processor then fetches them ahead, 2.5 times as fast. The
    row's own sum waits for nothing but y.
    """
    row, column, blocks = inner
    zero = np.float32(0.0)
    for q in range(low, high):
        for i in range(pieces[q + 1] - 1, pieces[q] - 1, -1):
            k = 3 * i
            for c in range(x.shape[0]):
                s, t, r = zero, zero, zero
                for p in range(row[i + 1] - 1, row[i] - 1, -1):
                    j = 3 * column[p]
                    u, v, w = x[c, j], x[c, j + 1], x[c, j + 2]
                    s += blocks[p, 0, 0] * u + blocks[p, 0, 1] * v + blocks[p, 0, 2] * w
                    t += blocks[p, 1, 0] * u + blocks[p, 1, 1] * v + blocks[p, 1, 2] * w
                    r += blocks[p, 2, 0] * u + blocks[p, 2, 1] * v + blocks[p, 2, 2] * w
                s, t, r = y[c, k] - s, y[c, k + 1] - t, y[c, k + 2] - r
                u = inverse[i, 0, 0] * s + inverse[i, 0, 1] * t + inverse[i, 0, 2] * r
                v = inverse[i, 1, 0] * s + inverse[i, 1, 1] * t + inverse[i, 1, 2] * r
                w = inverse[i, 2, 0] * s + inverse[i, 2, 1] * t + inverse[i, 2, 2] * r
                x[c, k], x[c, k + 1], x[c, k + 2] = u, v, w
                for p in range(row[i + 1] - 1, row[i] - 1, -1):
                    j = 3 * column[p]
                    y[c, j] -= blocks[p, 0, 0] * u + blocks[p, 1, 0] * v + blocks[p, 2, 0] * w
                    y[c, j + 1] -= blocks[p, 0, 1] * u + blocks[p, 1, 1] * v + blocks[p, 2, 1] * w
                    y[c, j + 2] -= blocks[p, 0, 2] * u + blocks[p, 1, 2] * v + blocks[p, 2, 2] * w


@njit(fastmath=FAST, cache=True, nogil=True)
def take_outer(low: int, high: int, pieces: Any, outer: Any, weakest: Any, x: Any, y: Any) -> None:
    """Add ``weakest x - outer x`` to y over the rows of a range of pieces."""
    row, column, blocks = outer
    for i in range(pieces[low], pieces[high]):
        if row[i] == row[i + 1]:
            continue
        for c in range(x.shape[0]):
            k = 3 * i
            for a in range(3):
                y[c, k + a] += weakest[k + a] * x[c, k + a]
            for p in range(row[i], row[i + 1]):
                j = 3 * column[p]
                for a in range(3):
                    y[c, k + a] -= (
                        blocks[p, a, 0] * x[c, j]
                        + blocks[p, a, 1] * x[c, j + 1]
                        + blocks[p, a, 2] * x[c, j + 2]
                    )
