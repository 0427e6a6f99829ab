"""Compiled Fourier series of period 1 with few waves."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def fourier_series(low, high, points, reach, waves, coefficients, value):
    """Real parts of ``sum c_m exp(2 pi i k_m . u)`` at a range of points, into (channels, n).

    ``waves`` (m, 3) whole numbers from -reach to reach, ``coefficients`` (channels, m) complex.
    """
    power = np.ones((3, 2 * reach + 1), dtype=np.complex128)
    for i in range(low, high):
        for axis in range(3):
            angle = 2.0 * math.pi * points[axis, i]
            step = complex(math.cos(angle), math.sin(angle))
            for k in range(1, reach + 1):
                power[axis, reach + k] = power[axis, reach + k - 1] * step
                power[axis, reach - k] = power[axis, reach + k].conjugate()
        for channel in range(value.shape[0]):
            value[channel, i] = 0.0
        for m in range(len(waves)):
            wave = (
                power[0, reach + waves[m, 0]]
                * power[1, reach + waves[m, 1]]
                * power[2, reach + waves[m, 2]]
            )
            for channel in range(value.shape[0]):
                c = coefficients[channel, m]
                value[channel, i] += c.real * wave.real - c.imag * wave.imag
