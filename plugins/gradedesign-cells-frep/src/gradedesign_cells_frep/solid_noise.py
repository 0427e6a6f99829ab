"""Solid noise of period 1: a sum of sines with seeded phases."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gradedesign import CaseError
from gradedesign.fields import FloatArray, compiled_values
from gradedesign_cells_frep._noise_kernels import fourier_series

#: Largest number of waves in a cell along an axis.
REACH = 2

#: Functions drawn from one seed: three for the place, one for the size.
_CHANNELS = 4


def wave_vectors() -> NDArray[np.int64]:
    """Whole wave vectors of at most `REACH` along each axis, one of each pair k, -k, ``(m, 3)``."""
    every = [k for k in product(range(-REACH, REACH + 1), repeat=3) if k > (0, 0, 0)]
    return np.array(every, dtype=np.int64)


def solid_noise(u: FloatArray, seed: float) -> FloatArray:
    """Smooth pseudo-random functions of period 1, each of mean 0 and mean square 1.

    ``sum_k c_k sin(2 pi k . u + phi_k)`` over `wave_vectors`, with c_k falling as ``1 / |k|``.

    Parameters
    ----------
    u : (3, ...) array, cell units
    seed : float
        Whole number from 0 that fixes all phases phi.

    Returns
    -------
    (4, ...) array
        Of the same float type.

    Raises
    ------
    CaseError
        If the seed is not a whole number from 0 to 2^31.

    References
    ----------
    Gardner, Simulation of natural scenes using textured quadric surfaces, SIGGRAPH '84, 11-20, as
    used by Pasko et al. 2009: sums of sines; here with whole wave vectors, for the period, in place
    of sines of sines.
    """
    if not (seed == round(seed) and 0 <= seed <= 2**31):
        raise CaseError(f"seed is {seed:g}, expected a whole number, 0 to {2**31}")
    return compiled_values(fourier_series, u, REACH, *series(int(seed)), channels=_CHANNELS)


@lru_cache(maxsize=64)
def series(seed: int) -> tuple[NDArray[np.int64], NDArray[np.complex128]]:
    """Wave vectors ``(m, 3)`` and complex coefficients ``(4, m)`` of the noise of a seed."""
    waves = wave_vectors()
    size = 1.0 / np.sqrt((waves**2).sum(axis=1))
    size *= np.sqrt(2.0 / (size**2).sum())
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, (_CHANNELS, len(waves)))
    coefficients = size * np.exp(1j * (phase - 0.5 * np.pi))
    waves.flags.writeable = coefficients.flags.writeable = False
    return waves, coefficients
