"""Local stress in a cell as a function of density and the whole macroscopic stress."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.strength_surface import StrengthSurface

#: Densities between which the least sufficient one is bracketed before it is found by bisection.
#: Chosen, not measured.
_SCAN = 129
#: Bisections of a density, to 2^-40 of an interval of the scan: far finer than sizing needs.
_BISECTIONS = 40
#: Points whose curves are held at once. Bounds the memory; the result does not depend on it.
#: Chosen, not measured.
_BATCH = 20_000
#: Shares of the percentile's stress below which all of the cell is stressed more. Chosen, not
#: measured.
_NO_STRESS = 1e-12
#: Rounding error by which a density may leave the window, as for laws.
_SLACK = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalStressLaw:
    """Strength surfaces of one cell at several densities, interpolated in between.

    A macroscopic stress is first turned into the local stress at every density of the law, its
    *profile*; profiles of several points or load cases can be averaged or enveloped. Between the
    densities the logarithm of a profile follows a monotone cubic in the logarithm of density.

    Attributes
    ----------
    density : (k,) array
        Increasing.
    surfaces : tuple of StrengthSurface
        One for each density, of one percentile.
    """

    density: FloatArray
    surfaces: tuple[StrengthSurface, ...]

    def __post_init__(self) -> None:
        count = len(self.surfaces)
        object.__setattr__(self, "density", locked(self.density, (count,), name="density"))
        if count < 2 or (np.diff(self.density) <= 0).any() or not self.density[0] > 0:
            raise ValueError(
                f"a law of local stress needs surfaces at two or more increasing positive "
                f"densities, found {self.density.tolist()}"
            )
        if len({s.percentile for s in self.surfaces}) > 1:
            raise ValueError("the surfaces of a law of local stress must share their percentile")

    @property
    def percentile(self) -> float:
        """By volume, of the local von Mises stress in the cell."""
        return self.surfaces[0].percentile

    def profile(self, stress: FloatArray) -> FloatArray:
        """Local stress at every density of the law.

        Parameters
        ----------
        stress : (6, ...) array
            Macroscopic Voigt stress in the cell's axes.

        Returns
        -------
        (k, ...) array
            In the unit of ``stress``.
        """
        return np.stack([surface.local_stress(stress) for surface in self.surfaces])

    def at(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Local stress at densities between those of the law.

        Parameters
        ----------
        profile : (k, n) array
        rho : (n,) array
            Inside the law's range.

        Returns
        -------
        (n,) array

        Raises
        ------
        DensityError
            If a density leaves the range.
        """
        values = self._inside(rho)
        local = np.zeros(profile.shape[1])
        for part, curves in self._curves(profile):
            local[part] = _on_curves(curves, np.log(values[part]))
        return local

    def least_density(
        self, profile: FloatArray, permitted: float, bounds: tuple[float, float]
    ) -> FloatArray:
        """Least density at and above which the local stress stays within what is permitted.

        Parameters
        ----------
        profile : (k, n) array, MPa
        permitted : float, MPa
        bounds : (float, float)
            Inside the law's range.

        Returns
        -------
        (n,) array
            The upper bound where that is not strong enough, for the caller to judge.

        Raises
        ------
        DensityError
            If the bounds leave the law's range.

        Notes
        -----
        Where local stress falls with density, as it does in every table shipped, that is where it
        equals what is permitted. Where it rises over some stretch, the density lies above the
        stretch if the stress there is too much: no density above the answer is worse.
        """
        lower, upper = self._inside(np.asarray(bounds))
        grid = np.log(np.linspace(lower, upper, _SCAN))
        rho = np.full(profile.shape[1], bounds[0])
        weak = self._exceeding(profile, permitted, (float(lower), float(upper)))
        for points, curves in self._curves(profile[:, weak]):
            part = weak[points]
            at_grid = np.stack([_on_curves(curves, np.full(part.size, x)) for x in grid])
            above = at_grid > permitted
            last = _SCAN - 1 - np.argmax(above[::-1], axis=0)
            strong, beyond = ~above.any(axis=0), above[-1]
            low = grid[last]
            high = grid[np.minimum(last + 1, _SCAN - 1)]
            for _ in range(_BISECTIONS):
                middle = 0.5 * (low + high)
                enough = _on_curves(curves, middle) <= permitted
                low, high = np.where(enough, low, middle), np.where(enough, middle, high)
            least = np.clip(np.exp(high), *bounds)
            rho[part] = np.where(strong, bounds[0], np.where(beyond, bounds[1], least))
        return rho

    @property
    def has_distribution(self) -> bool:
        """Whether it is known how the local stress is distributed in the cell."""
        return all(surface.distribution.shape[1] > 1 for surface in self.surfaces)

    def volume_above(self, stress_share: FloatArray, rho: FloatArray) -> FloatArray:
        """Share of a cell's solid where the local stress exceeds a multiple of its percentile.

        Parameters
        ----------
        stress_share : (n,) array
            The multiple; 1 gives the share above the percentile itself.
        rho : (n,) array
            Inside the law's range.

        Returns
        -------
        (n,) array

        Notes
        -----
        Logarithm of the share over logarithm of the stress, linear between the percentages known
        and in the logarithm of density; beyond the highest as from the last two.
        """
        place = np.log(self._inside(rho))
        knots = np.log(self.density)
        piece = np.clip(np.searchsorted(knots, place, side="right") - 1, 0, knots.size - 2)
        to_upper = (place - knots[piece]) / np.diff(knots)[piece]
        x = np.log(np.maximum(stress_share, _NO_STRESS))
        share = np.zeros(x.size)
        for i in np.unique(piece):
            here = piece == i
            lower, upper = (_log_exceedance(self.surfaces[j], x[here]) for j in (i, i + 1))
            share[here] = np.exp((1 - to_upper[here]) * lower + to_upper[here] * upper)
        return share

    def _inside(self, rho: FloatArray) -> FloatArray:
        """Densities as float64, refused outside the range."""
        values = np.asarray(rho, dtype=np.float64)
        a, b = float(self.density[0]), float(self.density[-1])
        inside = (values >= a - _SLACK) & (values <= b + _SLACK)
        if not inside.all():
            bad = values[~inside]
            raise DensityError(
                f"strength surfaces are known for relative densities {a:g} to {b:g}, but were "
                f"asked for {bad.min():g} to {bad.max():g} at {bad.size} points; narrow "
                f"[lattice] density"
            )
        # The range admits a rounding error beyond its ends, the curves must too.
        return np.asarray(np.clip(values, a, b))

    def _exceeding(
        self, profile: FloatArray, permitted: float, bounds: tuple[float, float]
    ) -> IntArray:
        """Points whose local stress may exceed what is permitted within the bounds.

        Curves are monotone between the densities of the law, which bound them.
        """
        first = np.searchsorted(self.density, bounds[0], side="right") - 1
        last = np.searchsorted(self.density, bounds[1], side="left")
        return np.flatnonzero(profile[first : last + 1].max(axis=0) > permitted)

    def _curves(self, profile: FloatArray) -> Iterator[tuple[IntArray, PchipInterpolator]]:
        """Logarithmic curves of the points that are stressed at all, some at a time."""
        stressed = np.flatnonzero(profile.min(axis=0) > 0)
        x = np.log(self.density)
        for start in range(0, stressed.size, _BATCH):
            part = stressed[start : start + _BATCH]
            yield part, PchipInterpolator(x, np.log(profile[:, part]))


def _log_exceedance(surface: StrengthSurface, x: FloatArray) -> FloatArray:
    """Logarithm of the volume share above ``exp(x)`` times the surface's local stress."""
    percent, stress = surface.distribution
    share, place = np.log1p(-percent / 100), np.log(stress)
    slope = (share[-1] - share[-2]) / (place[-1] - place[-2])
    beyond = share[-1] + slope * np.maximum(x - place[-1], 0.0)
    return np.where(x > place[-1], beyond, np.interp(x, place, share, left=0.0))


def _on_curves(curves: PchipInterpolator, x: FloatArray) -> FloatArray:
    """``exp`` of every curve at its own ``x``, ``(n,)``."""
    knots = curves.x
    piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
    a, b, c, d = curves.c[:, piece, np.arange(x.size)]
    h = x - knots[piece]
    return np.asarray(np.exp(((a * h + b) * h + c) * h + d))
