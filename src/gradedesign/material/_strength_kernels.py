"""Compiled sums of powers of quadratic forms over many stresses."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange

#: Stresses of one unit of threaded work: their products and sums fit the nearest cache.
CHUNK = 64


@njit(cache=True, parallel=True)
def mean_powers(entries, stress, half):
    """Mean over the first axis of ``entries`` of ``(entries . products) ** half``.

    Parameters
    ----------
    entries : (turns, k, 21) float64 array
        Upper triangles of symmetric forms, off-diagonal entries doubled.
    stress : (6, n) float64 array
    half : int
        At least 1.

    Returns
    -------
    (k, n) float64 array
        Forms below zero, by rounding, count as zero.
    """
    turns, forms, _ = entries.shape
    n = stress.shape[1]
    mean = np.zeros((forms, n))
    for chunk in prange((n + CHUNK - 1) // CHUNK):
        first = chunk * CHUNK
        count = min(CHUNK, n - first)
        products = np.zeros((21, CHUNK))
        row = 0
        for i in range(6):
            for j in range(i, 6):
                for p in range(count):
                    products[row, p] = stress[i, first + p] * stress[j, first + p]
                row += 1
        value = np.zeros(CHUNK)
        power = np.zeros(CHUNK)
        for k in range(forms):
            for turn in range(turns):
                value[:] = 0.0
                for c in range(21):
                    weight = entries[turn, k, c]
                    for p in range(CHUNK):
                        value[p] += weight * products[c, p]
                for p in range(CHUNK):
                    value[p] = max(value[p], 0.0)
                    power[p] = value[p]
                for _ in range(half - 1):
                    for p in range(CHUNK):
                        power[p] *= value[p]
                for p in range(count):
                    mean[k, first + p] += power[p]
        for k in range(forms):
            for p in range(count):
                mean[k, first + p] /= turns
    return mean
