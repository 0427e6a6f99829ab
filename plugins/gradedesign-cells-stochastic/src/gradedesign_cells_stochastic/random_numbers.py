"""Random numbers that depend on a seed and on nothing else."""

from __future__ import annotations

import numpy as np

from gradedesign import CaseError
from gradedesign.fields import FloatArray

#: Largest seed: whole numbers up to here are exact as floats, which is what parameters are.
_LARGEST_SEED = 2**53

_BITS = 53


def uniform(seed: float, stream: int, count: int) -> FloatArray:
    """Draw numbers from 0 up to below 1, ``(count,)``.

    Parameters
    ----------
    seed : float
        A whole number, as a case gives it.
    stream : int
        Numbers of different streams of one seed are independent.

    Raises
    ------
    CaseError
        If the seed is not a whole number from 0 to `_LARGEST_SEED`.

    Notes
    -----
    Taken from the raw bits of the generator, which numpy keeps the same from version to version;
    those of its distributions may change, and with them every part printed from a seed.
    """
    if not (float(seed).is_integer() and 0 <= seed <= _LARGEST_SEED):
        raise CaseError(f"seed is {seed:g}, expected a whole number from 0 to 2^53")
    bits = np.random.PCG64(np.random.SeedSequence([int(seed), stream])).random_raw(count)
    return np.asarray((bits >> np.uint64(64 - _BITS)) * 2.0**-_BITS)
