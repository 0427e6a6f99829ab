"""Compiled sums of powers of quadratic forms over many stresses."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit

#: Stresses of one unit of threaded work: their products and sums fit the nearest cache.
CHUNK = 64


# Called instead, the whole takes 1.5 to 2 times as long; compiling takes as long either way.
@njit(cache=True, nogil=True, inline="always")
def _add_seven(weight, product, value):
    """Add seven products at once: each sum is read and written once, not seven times."""
    for p in range(CHUNK):
        value[p] += (
            weight[0] * product[0, p]
            + weight[1] * product[1, p]
            + weight[2] * product[2, p]
            + weight[3] * product[3, p]
            + weight[4] * product[4, p]
            + weight[5] * product[5, p]
            + weight[6] * product[6, p]
        )


@njit(cache=True, nogil=True)
def mean_powers(low, high, entries, stress, half, mean):
    """Fill the mean over the first axis of ``entries`` of ``(entries . products) ** half``.

    Parameters
    ----------
    low, high : int
        Range of stresses.
    entries : (turns, k, 21) float64 array
        Upper triangles of symmetric forms, off-diagonal entries doubled.
    stress : (6, n) float64 array
    half : int
        At least 1.
    mean : (k, n) float64 array
        Written. Forms below zero, by rounding, count as zero.
    """
    turns, forms, _ = entries.shape
    products = np.zeros((21, CHUNK))
    value = np.zeros(CHUNK)
    power = np.zeros(CHUNK)
    total = np.zeros(CHUNK)
    for first in range(low, high, CHUNK):
        count = min(CHUNK, high - first)
        row = 0
        for i in range(6):
            for j in range(i, 6):
                for p in range(count):
                    products[row, p] = stress[i, first + p] * stress[j, first + p]
                row += 1
        for k in range(forms):
            for p in range(CHUNK):
                total[p] = 0.0
            for turn in range(turns):
                for p in range(CHUNK):
                    value[p] = 0.0
                for c in range(0, 21, 7):
                    _add_seven(entries[turn, k, c : c + 7], products[c : c + 7], value)
                for p in range(CHUNK):
                    value[p] = max(value[p], 0.0)
                    power[p] = value[p]
                for _ in range(half - 1):
                    for p in range(CHUNK):
                        power[p] *= value[p]
                for p in range(CHUNK):
                    total[p] += power[p]
            for p in range(count):
                mean[k, first + p] = total[p] / turns


@njit(cache=True, nogil=True)
def power_slopes(low, high, entries, weights, stress, half, slope):
    """Fill the derivative by stress of ``(weights . mean_powers) ** (1 / (2 half))``.

    Parameters
    ----------
    low, high : int
        Range of stresses.
    entries : (turns, k, 21) float64 array
    weights : (k,) float64 array
    stress : (6, n) float64 array
        None so large or small that its power with exponent ``2 half`` overflows or vanishes.
    half : int
    slope : (6, n) float64 array
        Written; zero before, and where the sum vanishes.
    """
    turns, forms, _ = entries.shape
    products, by_product = np.zeros((21, CHUNK)), np.zeros((21, CHUNK))
    value = np.zeros(CHUNK)
    power = np.zeros(CHUNK)
    total = np.zeros(CHUNK)
    for first in range(low, high, CHUNK):
        count = min(CHUNK, high - first)
        row = 0
        for i in range(6):
            for j in range(i, 6):
                for p in range(CHUNK):
                    by_product[row, p] = 0.0
                for p in range(count):
                    products[row, p] = stress[i, first + p] * stress[j, first + p]
                row += 1
        for p in range(CHUNK):
            total[p] = 0.0
        for turn in range(turns):
            for k in range(forms):
                for p in range(CHUNK):
                    value[p] = 0.0
                for c in range(0, 21, 7):
                    _add_seven(entries[turn, k, c : c + 7], products[c : c + 7], value)
                for p in range(CHUNK):
                    value[p] = max(value[p], 0.0)
                    power[p] = weights[k] / turns
                for _ in range(half - 1):
                    for p in range(CHUNK):
                        power[p] *= value[p]
                for p in range(CHUNK):
                    total[p] += power[p] * value[p]
                for c in range(21):
                    for p in range(CHUNK):
                        by_product[c, p] += power[p] * entries[turn, k, c]
        for p in range(count):
            # Of the root: half of its derivative by the sum, times that of the power.
            value[p] = 0.5 * total[p] ** (0.5 / half - 1.0) if total[p] > 0.0 else 0.0
        row = 0
        for i in range(6):
            for j in range(i, 6):
                for p in range(count):
                    by = value[p] * by_product[row, p]
                    slope[i, first + p] += by * stress[j, first + p]
                    slope[j, first + p] += by * stress[i, first + p]
                row += 1
