"""Compiled transfers of vectors to the new places of nodes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def take_scaled(
    r: NDArray[np.float64],
    order: NDArray[np.int32],
    scale: NDArray[np.float64],
    f: NDArray[np.float32],
) -> None:
    """Set f to vectors r over their scale, renumbered."""
    for c in range(r.shape[0]):
        factor = 1.0 / scale[c]
        for k in range(order.size):
            for a in range(3):
                f[c, 3 * k + a] = factor * r[c, 3 * order[k] + a]


@njit(cache=True, nogil=True)
def put_scaled(
    x: NDArray[np.float32],
    order: NDArray[np.int32],
    scale: NDArray[np.float64],
    z: NDArray[np.float64],
) -> None:
    """Undo `take_scaled`."""
    for c in range(x.shape[0]):
        for k in range(order.size):
            for a in range(3):
                z[c, 3 * order[k] + a] = scale[c] * x[c, 3 * k + a]


@njit(cache=True, nogil=True)
def add_midpoints(
    ends: NDArray[np.int32],
    keep: NDArray[np.float32],
    c: NDArray[np.float32],
    x: NDArray[np.float32],
) -> None:
    """Add to x at every node the mean of c at the two ends of its edge."""
    half = np.float32(0.5)
    for m in range(x.shape[0]):
        for i in range(ends.shape[1]):
            u, v = 3 * ends[0, i], 3 * ends[1, i]
            for a in range(3):
                x[m, 3 * i + a] += half * keep[3 * i + a] * (c[m, u + a] + c[m, v + a])
