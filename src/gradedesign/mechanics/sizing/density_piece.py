"""Interpolation of densities between those at which a quantity is known."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import DensityError


def density_piece(density: FloatArray, rho: FloatArray, quantity: str) -> IntArray:
    """Interval between increasing densities ``(k,)`` in which each of ``rho`` ``(M,)`` lies.

    Parameters
    ----------
    density : (k,) array
    rho : (M,) array
    quantity : str
        Name of the quantity that is known there, in the plural, for the message.

    Returns
    -------
    (M,) array
        From 0 to ``k - 2``.

    Raises
    ------
    DensityError
        If a density lies beyond the first or the last.
    """
    low, high = density[0], density[-1]
    if not ((rho >= low - 1e-9) & (rho <= high + 1e-9)).all():
        raise DensityError(
            f"{quantity} are known for relative densities {low:g} to {high:g}, but were asked for "
            f"{np.min(rho):g} to {np.max(rho):g}; narrow [lattice] density"
        )
    place = np.searchsorted(density, rho, side="right") - 1
    return np.clip(place, 0, density.size - 2)
