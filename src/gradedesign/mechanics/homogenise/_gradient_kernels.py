"""Vector operations of the conjugate gradients, each in one pass over memory.

Sums are taken in a fixed number of pieces, so that they do not depend on the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges

#: Pieces of a sum, at least one for every thread. Chosen, not measured.
PIECES = 64


def summed(kernel: Callable[..., None], *arguments: Any) -> float:
    """The sum of what a kernel finds in all pieces."""
    part = np.zeros(PIECES)
    in_ranges(kernel, range(PIECES), *arguments, part)
    return float(part.sum())


@njit(cache=True, fastmath={"contract", "reassoc"}, nogil=True)
def dot(low: int, high: int, a: NDArray[Any], b: NDArray[Any], part: FloatArray) -> None:
    """Inner product of two flat arrays, summed in float64, of a range of pieces."""
    n = a.size
    for t in range(low, high):
        total = 0.0
        for i in range(t * n // PIECES, (t + 1) * n // PIECES):
            total += np.float64(a[i]) * np.float64(b[i])
        part[t] = total


@njit(cache=True, fastmath={"contract", "reassoc"}, nogil=True)
def scaled_dot(
    low: int, high: int, r: FloatArray, z: NDArray[Any], scale: NDArray[Any], part: FloatArray
) -> None:
    """Inner product of ``r`` and ``scale z`` for fields ``(3, n)`` and a scale ``(n,)``."""
    n = scale.size
    for t in range(low, high):
        total = 0.0
        for c in range(3):
            for i in range(t * n // PIECES, (t + 1) * n // PIECES):
                total += r[c, i] * np.float64(z[c, i] * scale[i])
        part[t] = total


@njit(cache=True, fastmath={"contract", "reassoc"}, nogil=True)
def advance(
    low: int,
    high: int,
    x: FloatArray,
    r: FloatArray,
    p: FloatArray,
    y: FloatArray,
    alpha: float,
    scale: NDArray[Any],
    rough: NDArray[Any],
    part: FloatArray,
) -> None:
    """``x += alpha p``, ``r -= alpha y``, ``rough = scale r``; the part is that of ``r r``.

    Fields are ``(3, n)``; the scale ``(n,)`` and ``rough`` are in single precision.
    """
    n = scale.size
    for t in range(low, high):
        total = 0.0
        for c in range(3):
            for i in range(t * n // PIECES, (t + 1) * n // PIECES):
                x[c, i] += alpha * p[c, i]
                value = r[c, i] - alpha * y[c, i]
                r[c, i] = value
                rough[c, i] = scale[i] * np.float32(value)
                total += value * value
        part[t] = total


@njit(cache=True, fastmath={"contract"}, nogil=True)
def turn(
    low: int, high: int, p: FloatArray, z: NDArray[Any], scale: NDArray[Any], beta: float
) -> None:
    """``p = scale z + beta p`` for fields ``(3, n)``, in a range of pieces."""
    n = scale.size
    for t in range(low, high):
        for c in range(3):
            for i in range(t * n // PIECES, (t + 1) * n // PIECES):
                p[c, i] = np.float64(scale[i] * z[c, i]) + beta * p[c, i]


@njit(cache=True, fastmath={"contract"}, nogil=True)
def invert_blocks(low: int, high: int, spectrum: NDArray[Any], inverse: NDArray[Any]) -> None:
    """Multiply every frequency with its symmetric 3 by 3 block, in place.

    Parameters
    ----------
    low, high : int
        Range of pieces.
    spectrum : (3, n) complex array
    inverse : (6, n) array
        Entries xx, yy, zz, yz, xz, xy.
    """
    n = spectrum.shape[1]
    for t in range(low, high):
        for i in range(t * n // PIECES, (t + 1) * n // PIECES):
            a, b, c = spectrum[0, i], spectrum[1, i], spectrum[2, i]
            xx, yy, zz = inverse[0, i], inverse[1, i], inverse[2, i]
            yz, xz, xy = inverse[3, i], inverse[4, i], inverse[5, i]
            spectrum[0, i] = xx * a + xy * b + xz * c
            spectrum[1, i] = xy * a + yy * b + yz * c
            spectrum[2, i] = xz * a + yz * b + zz * c
