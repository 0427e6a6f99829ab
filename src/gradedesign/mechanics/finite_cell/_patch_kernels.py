"""Inverted stiffness of small groups of weakly held nodes, applied as an additive smoother."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def assemble_patches(
    low: int, high: int, weak: Any, nodes: Any, kind: Any, place: Any, position: Any, size: Any,
    chosen: Any, row_of: Any, first: Any, near: Any, matrices: Any, out: Any,
) -> None:  # fmt: skip
    """Stiffness of the weak nodes of some elements, all elements around them included.

    Parameters
    ----------
    low, high : int
        Range of `chosen`.
    weak : (N,) bool array
    nodes : (n, 27) int32 array
        Free nodes of the elements.
    kind : (n,) int array
        0 where these are the element's own.
    place : (N, 3) int32 array
        Of the nodes, in half edges.
    position : (n, 3) int32 array
    size : (n,) int8 array
        Of the elements.
    chosen : (k,) int array
        Elements of equal numbers of weak nodes.
    row_of : (n,) int array
        Row of an element in `matrices`.
    first, near : int arrays
        Elements of every weak node (none for the others).
    matrices : (m, 81, 81) array
    out : (k, w, w) array
        Written: symmetric matrices, unknowns in the order of the element's weak nodes.
    """
    own = np.zeros(27, np.int64)
    local = np.zeros(27, np.int64)
    for r in range(low, high):
        e = chosen[r]
        count = 0
        for a in range(27):
            if weak[nodes[e, a]]:
                own[count] = nodes[e, a]
                count += 1
        for i in range(count):
            n = own[i]
            for q in range(first[n], first[n + 1]):
                other = near[q]
                s = size[other]
                for j in range(count):
                    local[j] = -1
                    if kind[other] != 0:
                        for a in range(27):
                            if nodes[other, a] == own[j]:
                                local[j] = a
                        continue
                    x = place[own[j], 0] - 2 * position[other, 0]
                    y = place[own[j], 1] - 2 * position[other, 1]
                    z = place[own[j], 2] - 2 * position[other, 2]
                    inside = 0 <= x <= 2 * s and 0 <= y <= 2 * s and 0 <= z <= 2 * s
                    if inside and x % s == 0 and y % s == 0 and z % s == 0:
                        a = x // s + 3 * (y // s) + 9 * (z // s)
                        if nodes[other, a] == own[j]:
                            local[j] = a
                m = row_of[other]
                for j in range(count):
                    if local[j] >= 0:
                        for c in range(3):
                            for d in range(3):
                                out[r, 3 * i + c, 3 * j + d] += matrices[
                                    m, 3 * local[i] + c, 3 * local[j] + d
                                ]


@njit(cache=True, nogil=True)
def colour_patches(nodes: Any, weak: Any, colour: Any) -> None:
    """Give each patch the first colour that none before it with a common weak node has.

    Parameters
    ----------
    nodes : (k, 27) int32 array
    weak : (N,) bool array
    colour : (k,) int array
        Written.
    """
    # One bit for each colour; where they do not suffice, a patch has a colour to itself.
    taken = np.zeros(weak.size, np.int64)
    last = 62
    for e in range(nodes.shape[0]):
        used = np.int64(0)
        for a in range(27):
            if weak[nodes[e, a]]:
                used |= taken[nodes[e, a]]
        k = 0
        while k < 62 and (used >> k) & 1:
            k += 1
        if k == 62:
            colour[e] = last
            last += 1
            continue
        colour[e] = k
        for a in range(27):
            if weak[nodes[e, a]]:
                taken[nodes[e, a]] |= np.int64(1) << k


@njit(fastmath=True, cache=True, nogil=True)
def invert_factors(
    low: int, high: int, matrices: Any, free: Any, shift: Any, begin: Any, first: Any, scale: Any,
    height: Any, rows: Any,
) -> None:  # fmt: skip
    """Invert the Cholesky factors of symmetric matrices and round them to 8 bits.

    With S the inverted roots of the diagonal, S A S = L L^T and A^-1 = S (L^-1)^T L^-1 S: a product
    that stays positive definite however its factor is rounded.

    Parameters
    ----------
    low, high : int
        Range of matrices.
    matrices : (k, w, w) array
        Their lower triangles are overwritten.
    free : (k, w) array
        Zero for fixed unknowns.
    shift : float
        Added to the diagonal of S A S.
    begin : (k,) int array
        Where the rows of each begin in `rows`.
    first : (k,) int array
        Where its unknowns begin in `scale` and `height`.
    scale : (n,) float32 array
        Written: S, zero for fixed unknowns.
    height : (n,) float32 array
        Written: square of the step of 8 bits of each row of L^-1.
    rows : (total,) int8 array
        Written: rows of L^-1 up to the diagonal, in their steps.
    """
    width = matrices.shape[1]
    s = np.zeros(width)
    own = np.zeros(width)
    for p in range(low, high):
        a = matrices[p]
        for i in range(width):
            s[i] = 0.0
            if free[p, i] != 0:
                s[i] = 1.0 / np.sqrt(a[i, i])
        for i in range(width):
            for j in range(i):
                a[i, j] *= s[i] * s[j]
            a[i, i] = 1.0 + shift
        for i in range(width):
            for j in range(i + 1):
                total = a[i, j]
                for q in range(j):
                    total -= a[i, q] * a[j, q]
                if j < i:
                    a[i, j] = total / a[j, j]
                else:
                    a[i, i] = np.sqrt(total)
        # Row i of L^-1 takes the rows before it, which stand in place of those of L by then.
        for i in range(width):
            for j in range(i):
                own[j] = 0.0
            for q in range(i):
                factor = a[i, q]
                for j in range(q + 1):
                    own[j] -= factor * a[q, j]
            inverse = 1.0 / a[i, i]
            for j in range(i):
                a[i, j] = own[j] * inverse
            a[i, i] = inverse
        at = begin[p]
        for i in range(width):
            most = 0.0
            for j in range(i + 1):
                most = max(most, abs(a[i, j]))
            step = most / 127.0
            for j in range(i + 1):
                rows[at + j] = np.int8(np.rint(a[i, j] / step))
            at += i + 1
            height[first[p] + i] = step * step
            scale[first[p] + i] = s[i]


@njit(fastmath=True, cache=True, nogil=True)
def add_patches(
    low: int, high: int, weak: Any, nodes: Any, chosen: Any, begin: Any, first: Any, scale: Any,
    height: Any, rows: Any, part: Any, r: Any, z: Any,
) -> None:  # fmt: skip
    """Add a part of the solutions of a range of patches without common nodes.

    The residual r and z are ``(N, 3)``, the factors those of `invert_factors`.
    """
    f = np.zeros(81, r.dtype)
    g = np.zeros(81, r.dtype)
    local = np.zeros(27, np.int64)
    for p in range(low, high):
        e = chosen[p]
        size = 0
        own = first[p]
        for a in range(27):
            n = nodes[e, a]
            if weak[n]:
                local[size] = n
                for d in range(3):
                    f[3 * size + d] = scale[own + 3 * size + d] * r[n, d]
                    g[3 * size + d] = 0
                size += 1
        at = begin[p]
        for i in range(3 * size):
            # A view: indices that may be negative keep loops from vector instructions.
            row = rows[at : at + i + 1]
            total = r.dtype.type(0.0)
            for j in range(i + 1):
                total += r.dtype.type(row[j]) * f[j]
            total *= height[own + i]
            for j in range(i + 1):
                g[j] += r.dtype.type(row[j]) * total
            at += i + 1
        for i in range(size):
            for d in range(3):
                z[local[i], d] += part * scale[own + 3 * i + d] * g[3 * i + d]


@njit(fastmath=True, cache=True, nogil=True)
def block_jacobi(low: int, high: int, inverse: Any, f: Any, y: Any, r: Any, z: Any) -> None:
    """Set r = f - y and z = D^-1 r with 3 by 3 blocks, in a range of rows."""
    for i in range(low, high):
        for c in range(3):
            r[i, c] = f[i, c] - y[i, c]
        for c in range(3):
            z[i, c] = (
                inverse[i, c, 0] * r[i, 0]
                + inverse[i, c, 1] * r[i, 1]
                + (inverse[i, c, 2] * r[i, 2])
            )


@njit(fastmath=True, cache=True, nogil=True)
def step_along(low: int, high: int, momentum: Any, step: Any, z: Any, d: Any, x: Any) -> None:
    """D = momentum d + step z, x += d, in a range of rows."""
    for i in range(low, high):
        for c in range(3):
            d[i, c] = momentum * d[i, c] + step * z[i, c]
            x[i, c] += d[i, c]


@njit(fastmath=True, cache=True, nogil=True)
def masked_residual(low: int, high: int, keep: Any, f: Any, y: Any) -> None:
    """Set y to keep (f - y), in a range of rows."""
    for i in range(low, high):
        for c in range(3):
            y[i, c] = keep[i, c] * (f[i, c] - y[i, c])
