"""Stiffness of quadratic bricks times a vector, by sum factorisation, 64 elements at a time.

Elements of one colour share no node, so that threads write without locks. Every array is flat and
numeric: a kernel for another device can take the same arguments.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

#: Elements side by side, the lanes of vector instructions: inner loops of 16 spend most of their
#: time on their beginnings and ends (75 against 39 ms in single precision, 98 against 65 in double,
#: 39,304 cut elements on two cores).
LANES = 64


@njit(fastmath=True, cache=True, nogil=True)
def add_product(
    low: int, high: int, nodes: Any, size: Any, first: int, weights: Any, every: Any, shapes: Any,
    slopes: Any, moduli: Any, u: Any, y: Any,
) -> None:  # fmt: skip
    """Add K u of a range of elements of one colour to y.

    Parameters
    ----------
    nodes : (n, 27) int32 array
    size : (n,) int8 array
        Edge of each element over that of the grid: its stiffness grows with it.
    first : int
        Element of the first row of weights.
    weights : (m, Q^3) array
        At Gauss points of cut elements; no row where all are whole.
    every : (2, Q^3) array
        Factor of the weights, and what is added to them, at the same points of all elements.
    shapes : (Q, 3) array
    slopes : (3, Q, 3) array
        Per axis, over the edge's length.
    moduli : (2, 3, 3) array
        Couplings of normal strains and shear moduli, times the volume of an element.
    u, y : (N, 3) array
    """
    q1 = shapes.shape[0]
    q2 = q1 * q1
    q3 = q2 * q1
    cut = weights.shape[0] > 0
    n00, n01, n02 = moduli[0, 0, 0], moduli[0, 0, 1], moduli[0, 0, 2]
    n11, n12, n22 = moduli[0, 1, 1], moduli[0, 1, 2], moduli[0, 2, 2]
    s01, s02, s12 = moduli[1, 0, 1], moduli[1, 0, 2], moduli[1, 1, 2]
    ue = np.zeros((27, LANES), u.dtype)
    a1 = np.zeros((9 * q1, LANES), u.dtype)
    a2 = np.zeros((9 * q1, LANES), u.dtype)
    b1 = np.zeros((3 * q2, LANES), u.dtype)
    b2 = np.zeros((3 * q2, LANES), u.dtype)
    b3 = np.zeros((3 * q2, LANES), u.dtype)
    g = np.zeros((3, 3, q3, LANES), u.dtype)
    w = np.zeros((q3, LANES), u.dtype)
    near = np.zeros((27, LANES), np.int32)
    for e0 in range(low, high, LANES):
        m = min(LANES, high - e0)
        for v in range(LANES):
            e = e0 + min(v, m - 1)
            for a in range(27):
                near[a, v] = nodes[e, a]
            if v < m and cut:
                for a in range(q3):
                    own = every[0, a] * weights[e - first, a]
                    w[a, v] = size[e] * (own + every[1, a])
            elif v < m:
                for a in range(q3):
                    w[a, v] = size[e] * every[1, a]
            else:
                for a in range(q3):
                    w[a, v] = 0
        for d in range(3):
            for a in range(27):
                for v in range(LANES):
                    ue[a, v] = u[near[a, v], d]
            for k in range(9):
                for p in range(q1):
                    n0, n1, n2 = shapes[p, 0], shapes[p, 1], shapes[p, 2]
                    d0, d1, d2 = slopes[0, p, 0], slopes[0, p, 1], slopes[0, p, 2]
                    for v in range(LANES):
                        x0, x1, x2 = ue[3 * k, v], ue[3 * k + 1, v], ue[3 * k + 2, v]
                        a1[k * q1 + p, v] = n0 * x0 + n1 * x1 + n2 * x2
                        a2[k * q1 + p, v] = d0 * x0 + d1 * x1 + d2 * x2
            for k in range(3):
                for p in range(q1):
                    n0, n1, n2 = shapes[p, 0], shapes[p, 1], shapes[p, 2]
                    d0, d1, d2 = slopes[1, p, 0], slopes[1, p, 1], slopes[1, p, 2]
                    for i in range(q1):
                        o = 3 * k * q1 + i
                        t = k * q2 + p * q1 + i
                        for v in range(LANES):
                            x0, x1, x2 = a1[o, v], a1[o + q1, v], a1[o + 2 * q1, v]
                            b1[t, v] = n0 * x0 + n1 * x1 + n2 * x2
                            b2[t, v] = d0 * x0 + d1 * x1 + d2 * x2
                            b3[t, v] = n0 * a2[o, v] + n1 * a2[o + q1, v] + n2 * a2[o + 2 * q1, v]
            for p in range(q1):
                n0, n1, n2 = shapes[p, 0], shapes[p, 1], shapes[p, 2]
                d0, d1, d2 = slopes[2, p, 0], slopes[2, p, 1], slopes[2, p, 2]
                for o in range(q2):
                    t = p * q2 + o
                    for v in range(LANES):
                        g[d, 0, t, v] = n0 * b3[o, v] + n1 * b3[o + q2, v] + n2 * b3[o + 2 * q2, v]
                        g[d, 1, t, v] = n0 * b2[o, v] + n1 * b2[o + q2, v] + n2 * b2[o + 2 * q2, v]
                        g[d, 2, t, v] = d0 * b1[o, v] + d1 * b1[o + q2, v] + d2 * b1[o + 2 * q2, v]
        for p in range(q3):
            for v in range(LANES):
                own = w[p, v]
                xx, yy, zz = own * g[0, 0, p, v], own * g[1, 1, p, v], own * g[2, 2, p, v]
                xy = own * s01 * (g[0, 1, p, v] + g[1, 0, p, v])
                xz = own * s02 * (g[0, 2, p, v] + g[2, 0, p, v])
                yz = own * s12 * (g[1, 2, p, v] + g[2, 1, p, v])
                g[0, 0, p, v] = n00 * xx + n01 * yy + n02 * zz
                g[1, 1, p, v] = n01 * xx + n11 * yy + n12 * zz
                g[2, 2, p, v] = n02 * xx + n12 * yy + n22 * zz
                g[0, 1, p, v] = xy
                g[1, 0, p, v] = xy
                g[0, 2, p, v] = xz
                g[2, 0, p, v] = xz
                g[1, 2, p, v] = yz
                g[2, 1, p, v] = yz
        for d in range(3):
            b1[:] = 0
            b2[:] = 0
            b3[:] = 0
            a1[:] = 0
            a2[:] = 0
            ue[:] = 0
            for p in range(q1):
                for k in range(3):
                    nk = shapes[p, k]
                    dk = slopes[2, p, k]
                    for o in range(q2):
                        t = p * q2 + o
                        for v in range(LANES):
                            b3[k * q2 + o, v] += nk * g[d, 0, t, v]
                            b2[k * q2 + o, v] += nk * g[d, 1, t, v]
                            b1[k * q2 + o, v] += dk * g[d, 2, t, v]
            for k in range(3):
                for p in range(q1):
                    for j in range(3):
                        nj = shapes[p, j]
                        dj = slopes[1, p, j]
                        for i in range(q1):
                            t = k * q2 + p * q1 + i
                            o = 3 * k * q1 + j * q1 + i
                            for v in range(LANES):
                                a1[o, v] += nj * b1[t, v] + dj * b2[t, v]
                                a2[o, v] += nj * b3[t, v]
            for k in range(9):
                for p in range(q1):
                    for i in range(3):
                        ni = shapes[p, i]
                        di = slopes[0, p, i]
                        for v in range(LANES):
                            ue[3 * k + i, v] += ni * a1[k * q1 + p, v]
                            ue[3 * k + i, v] += di * a2[k * q1 + p, v]
            for a in range(27):
                for v in range(m):
                    y[near[a, v], d] += ue[a, v]


@njit(fastmath=True, cache=True, nogil=True)
def add_dense(low: int, high: int, nodes: Any, which: Any, blocks: Any, u: Any, y: Any) -> None:
    """Add the product of dense matrices of a range of elements of one colour to y.

    Parameters
    ----------
    nodes : (n, 27) int32 array
    which : (k,) int array
        Elements.
    blocks : (k, 81, 81) array
    u, y : (N, 3) array
    """
    for r in range(low, high):
        e = which[r]
        for a in range(27):
            for d in range(3):
                total = u.dtype.type(0)
                for b in range(27):
                    n = nodes[e, b]
                    for f in range(3):
                        total += blocks[r, 3 * a + d, 3 * b + f] * u[n, f]
                y[nodes[e, a], d] += total
