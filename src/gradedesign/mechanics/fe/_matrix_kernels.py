"""Compiled kernels: checks of many 6 by 6 matrices, and their upper triangles element by element.

Every element is computed alone, so results do not depend on the number of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def skewness(low: int, high: int, C: Any, skew: Any, size: Any) -> None:
    """Largest difference of matrices ``(6, 6, p, m)`` from their transpose, and largest entry.

    ``skew``, ``size``, each ``(m,)``: over the p matrices of every element.
    """
    for e in range(low, high):
        worst, most = 0.0, 0.0
        for i in range(6):
            for j in range(i, 6):
                for p in range(C.shape[2]):
                    worst = max(worst, abs(C[i, j, p, e] - C[j, i, p, e]))
                    most = max(most, abs(C[i, j, p, e]))
        skew[e], size[e] = worst, most


@njit(cache=True, nogil=True)
def upper_rows(low: int, high: int, C: Any, rows: Any) -> None:
    """Upper triangles by rows ``(m, p, 21)`` of matrices ``(6, 6, p, m)``."""
    for e in range(low, high):
        for p in range(C.shape[2]):
            k = 0
            for i in range(6):
                for j in range(i, 6):
                    rows[e, p, k] = C[i, j, p, e]
                    k += 1


@njit(cache=True, nogil=True)
def least_pivots(low: int, high: int, C: Any, least: Any) -> None:
    """Least pivot of Gauss's elimination of symmetric matrices ``(6, 6, p, m)``.

    ``least (m,)``: over the p matrices of every element. All of them are positive definite where it
    is positive; not a number is not.
    """
    a = np.zeros((6, 6))
    for e in range(low, high):
        least[e] = np.inf
        for p in range(C.shape[2]):
            for i in range(6):
                for j in range(i, 6):
                    a[i, j] = C[i, j, p, e]
            for k in range(6):
                pivot = a[k, k]
                if not pivot >= least[e]:
                    least[e] = pivot
                if not pivot > 0.0:
                    break
                for i in range(k + 1, 6):
                    factor = a[k, i] / pivot
                    for j in range(i, 6):
                        a[i, j] -= factor * a[k, j]
