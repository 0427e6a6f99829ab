"""Factor on the stiffness of every tetrahedron's lattice, as a function of its density."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.sizing.density_piece import density_piece


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalFactor:
    """Piecewise linear between densities; there is none beyond them.

    Attributes
    ----------
    density : (k,) array
        Increasing.
    factor : (k, M) array
        Positive.
    """

    density: FloatArray
    factor: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", locked(self.density, (None,), name="density"))
        shape = (self.density.size, None)
        object.__setattr__(self, "factor", locked(self.factor, shape, name="factor"))
        rising = self.density.size > 1 and (np.diff(self.density) > 0).all()
        if not rising or not (self.factor > 0).all():
            raise ValueError("densities must increase, two or more, and factors be positive")

    def at(self, rho: FloatArray) -> FloatArray:
        """Factor at densities ``(M,)``, ``(M,)``."""
        piece, upper, every = self._piece(rho)
        low, high = self.factor[piece, every], self.factor[piece + 1, every]
        return np.asarray((1 - upper) * low + upper * high)

    def slope(self, rho: FloatArray) -> FloatArray:
        """d(factor)/d(rho), ``(M,)``."""
        piece, _, every = self._piece(rho)
        rise = self.factor[piece + 1, every] - self.factor[piece, every]
        return np.asarray(rise / (self.density[piece + 1] - self.density[piece]))

    def _piece(self, rho: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
        """Interval of every density, how far it lies towards its upper end, and the index."""
        piece = density_piece(self.density, rho, "finite-size factors")
        width = self.density[piece + 1] - self.density[piece]
        return piece, (rho - self.density[piece]) / width, np.arange(rho.size)
