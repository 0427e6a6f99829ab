"""Macroscopic stress that buckles a cell, as a function of density and the whole stress."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.material.buckling_table import BucklingTable

#: Utilisations below this count as none. Keeps quotients finite.
_NO_UTILISATION = 1e-30
#: Exponent of density with which critical stresses grow beyond the densest computed cell. Those of
#: slender struts grow with its square, of walls with its cube: 1 is on the safe side.
GROWTH_BEYOND = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BucklingLaw:
    """Share of its resistance against buckling that a cell uses under any macroscopic stress.

    The stresses under which a linear elastic body does not buckle form a convex set: those for
    which the stiffness plus a geometric stiffness linear in the stress stays positive (Papkovich
    1934). It holds the origin and the critical stresses of single components, hence everything
    between them: where the components over their own critical values sum up to less than one, no
    mode that was searched buckles. That is safe, and for several components at once often far
    from the true load. Modes that repeat after more than two cells were not searched.

    Notes
    -----
    Between the densities the logarithm of the utilisation is linear in that of density. It is a sum
    of terms that fall with density, so that this is above what power laws through the table would
    give. Above the window the critical stresses grow with the density, as if the cell buckled at
    one mean stress of its material: all that were computed grow faster (exponents 1.2 to 7), as
    Euler's load of a strut does (2), so that this is safe. Below it the power law of the two least
    densities goes on: the caller says so.
    """

    table: BucklingTable

    def __post_init__(self) -> None:
        if (np.diff(self.table.critical, axis=0) < 0).any():
            raise ValueError(
                "critical stresses of a table of buckling fall with density; compute it at a "
                "higher resolution"
            )

    @property
    def window(self) -> tuple[float, float]:
        """Densities between which critical stresses were computed."""
        return float(self.table.density[0]), float(self.table.density[-1])

    def profile(self, stress: FloatArray) -> FloatArray:
        """Use at every density of the law.

        ``stress (6, ...)``: macroscopic Voigt stress in the cell's axes over the base material's
        Young's modulus. Returns ``(k, ...)``: 1 where buckling cannot be excluded any more.
        """
        sizes = np.stack([np.maximum(-stress, 0.0), np.maximum(stress, 0.0)], axis=1)
        return np.tensordot(1 / self.table.critical, sizes, axes=([1, 2], [0, 1]))

    def at(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Use at any density, from a profile ``(k, n)`` and densities ``(n,)``; ``(n,)``."""
        return self.slopes(profile, rho)[0]

    def slopes(
        self, profile: FloatArray, rho: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The use with its derivatives by density ``(n,)`` and by the profile ``(k, n)``."""
        x, knots = np.log(rho), np.log(self.table.density)
        beyond = np.maximum(x - knots[-1], 0.0)
        x = np.minimum(x, knots[-1])
        piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
        width = np.diff(knots)[piece]
        place = (x - knots[piece]) / width
        kept = np.maximum(profile, _NO_UTILISATION)
        y = np.log(kept)
        column = np.arange(x.size)
        low, high = y[piece, column], y[piece + 1, column]
        use = np.exp(low + place * (high - low) - GROWTH_BEYOND * beyond)
        by_rho = use / rho * np.where(beyond > 0.0, -GROWTH_BEYOND, (high - low) / width)
        by_profile = np.zeros(profile.shape)
        by_profile[piece, column] = use * (1.0 - place)
        by_profile[piece + 1, column] = use * place
        return use, by_rho, by_profile / kept

    def stress_slope(self, stress: FloatArray, by_profile: FloatArray) -> FloatArray:
        """Derivative by stresses ``(6, n, q)`` of what depends on the mean profile ``(k, n)``."""
        below, above = (
            np.einsum("kn,ka->an", by_profile, 1 / self.table.critical[:, :, sense])
            for sense in range(2)
        )
        slope = np.where(stress < 0.0, -below[:, :, None], above[:, :, None])
        return np.asarray(slope / stress.shape[2])

    def power_fit(self, component: int, sense: int) -> tuple[float, float, float]:
        """``c``, ``n`` and largest relative residual of ``c rho^n`` for one critical stress."""
        x, y = np.log(self.table.density), np.log(self.table.critical[:, component, sense])
        n, c = np.polyfit(x, y, 1)
        residual = float(np.abs(np.expm1(c + n * x - y)).max())
        return float(np.exp(c)), float(n), residual
