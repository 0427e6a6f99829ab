"""Compiled updates of conjugate gradients: one pass over memory each."""

from __future__ import annotations

from typing import Any

from numba import njit

#: Only fused multiply-add, as in the products.
FAST = {"contract"}


@njit(fastmath=FAST, cache=True, nogil=True)
def descend(x: Any, r: Any, p: Any, q: Any, alpha: float) -> float:
    """``x += alpha p``, ``r -= alpha q``; returns the square of r, summed in four strides."""
    n = x.size
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    whole = 4 * (n // 4)
    for i in range(0, whole, 4):
        x[i] += alpha * p[i]
        x[i + 1] += alpha * p[i + 1]
        x[i + 2] += alpha * p[i + 2]
        x[i + 3] += alpha * p[i + 3]
        a, b = r[i] - alpha * q[i], r[i + 1] - alpha * q[i + 1]
        c, d = r[i + 2] - alpha * q[i + 2], r[i + 3] - alpha * q[i + 3]
        r[i], r[i + 1], r[i + 2], r[i + 3] = a, b, c, d
        s0 += a * a
        s1 += b * b
        s2 += c * c
        s3 += d * d
    for i in range(whole, n):
        x[i] += alpha * p[i]
        r[i] -= alpha * q[i]
        s0 += r[i] * r[i]
    return float((s0 + s1) + (s2 + s3))


@njit(fastmath=FAST, cache=True, nogil=True)
def turn(p: Any, z: Any, beta: float) -> None:
    """``p = beta p + z``."""
    for i in range(p.size):
        p[i] = beta * p[i] + z[i]
