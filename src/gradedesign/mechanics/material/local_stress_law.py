"""Local stress in a cell as a function of density and the whole macroscopic stress."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.monotone_cubic import cubic_derivatives
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
    """

    density: FloatArray  #: ``(k,)``. Increasing.
    surfaces: tuple[StrengthSurface, ...]  #: One for each density, of one percentile.

    def __post_init__(self) -> None:
        count = len(self.surfaces)
        lock(self, density=(count,))
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

    def profile(self, stress: FloatArray, rho: FloatArray | None = None) -> FloatArray:
        """Local stress at every density of the law.

        ``stress (6, ...)``: macroscopic Voigt stress in the cell's axes. ``rho (n,)``: of points
        ``(n, q)``, where nothing but their `slopes` is asked for: at densities that their cubics do
        not know the nearest value that they do stands. Returns ``(k, ...)``: in the unit of
        ``stress``.
        """
        if rho is None:
            return np.stack([surface.local_stress(stress) for surface in self.surfaces])
        count = self.density.size
        place = np.searchsorted(self.density, rho, side="right") - 1
        # Slopes at the ends of a piece follow from the pieces beside it, at an end of the law from
        # its first two.
        first = np.clip(place - 1, 0, max(count - 3, 0))
        last = np.clip(place + 2, min(2, count - 1), count - 1)
        values = np.zeros((count, *stress.shape[1:]))
        for k, surface in enumerate(self.surfaces):
            some = np.flatnonzero((first <= k) & (k <= last))
            if some.size:
                values[k, some] = surface.local_stress(stress[:, some])
        known = np.clip(np.arange(count)[:, None], first, last)
        return np.take_along_axis(values, known[..., None], axis=0)

    def at(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Local stress at densities between those of the law.

        Raises `DensityError` if a density leaves the range. Returns ``(n,)``.

        ``profile (k, n)``. ``rho (n,)``: inside the law's range.
        """
        return self.slopes(profile, rho)[0]

    def slopes(
        self, profile: FloatArray, rho: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Local stress of `at` ``(n,)``, its derivatives by density and by the profile (k, n)."""
        place = np.log(self._inside(rho))
        local, by_rho = np.zeros(rho.size), np.zeros(rho.size)
        by_profile = np.zeros(profile.shape)
        some = np.flatnonzero(profile.min(axis=0) > 0)
        value, by_place, by_value = cubic_derivatives(
            np.log(self.density), np.log(profile[:, some]), place[some]
        )
        local[some] = np.exp(value)
        by_rho[some] = local[some] * by_place / rho[some]
        by_profile[:, some] = local[some] * by_value / profile[:, some]
        return local, by_rho, by_profile

    def stress_slope(self, stress: FloatArray, by_profile: FloatArray) -> FloatArray:
        """Derivative by macroscopic stress of what depends on its profile.

        ``stress (6, n, q)``. ``by_profile (k, n)``: derivatives by the means over the q points of
        the profile. Returns ``(6, n, q)``.
        """
        slope = np.zeros(stress.shape)
        for surface, weight in zip(self.surfaces, by_profile, strict=True):
            some = np.flatnonzero(weight)
            slope[:, some] += weight[some, None] * surface.slope(stress[:, some])
        return slope / stress.shape[2]

    def least_density(
        self, profile: FloatArray, permitted: float, bounds: tuple[float, float]
    ) -> FloatArray:
        """Least density at and above which the local stress stays within what is permitted.

        Raises `DensityError` if the bounds leave the law's range. Returns ``(n,)``: the upper bound
        where that is not strong enough, for the caller to judge.

        ``profile (k, n)``, MPa. ``permitted``, MPa. ``bounds``: inside the law's range.

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

    def volume_slopes(
        self, stress_share: FloatArray, rho: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Share of a cell's solid where the local stress exceeds a multiple of its percentile.

        ``stress_share (n,)``: the multiple; 1 gives the share above the percentile itself.
        ``rho (n,)``: inside the law's range. Returns ``share (n,)``; ``by_stress (n,)``: derivative
        by the logarithm of the multiple; ``by_rho (n,)``.

        Notes
        -----
        Logarithm of the share over logarithm of the stress, linear between the percentages known
        and in the logarithm of density; beyond them as from the nearest two, up to all of the
        solid.
        """
        place = np.log(self._inside(rho))
        knots = np.log(self.density)
        piece = np.clip(np.searchsorted(knots, place, side="right") - 1, 0, knots.size - 2)
        width = np.diff(knots)[piece]
        to_upper = (place - knots[piece]) / width
        x = np.log(np.maximum(stress_share, _NO_STRESS))
        share, by_stress, by_rho = (np.zeros(x.size) for _ in range(3))
        for i in np.unique(piece):
            here = piece == i
            (lower, falls), (upper, rises) = (
                _log_exceedance(self.surfaces[j], x[here]) for j in (i, i + 1)
            )
            t = to_upper[here]
            share[here] = np.exp((1 - t) * lower + t * upper)
            by_stress[here] = share[here] * ((1 - t) * falls + t * rises)
            by_rho[here] = share[here] * (upper - lower) / (width[here] * rho[here])
        return share, by_stress, by_rho

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


def _log_exceedance(surface: StrengthSurface, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithm of the volume share above ``exp(x)`` times the local stress, and its slope."""
    percent, stress = surface.distribution
    share, place = np.log1p(-percent / 100), np.log(stress)
    slopes = np.diff(share) / np.diff(place)
    slope = slopes[np.clip(np.searchsorted(place, x) - 1, 0, slopes.size - 1)]
    outside = slopes[-1] * np.maximum(x - place[-1], 0.0)
    outside += slopes[0] * np.minimum(x - place[0], 0.0)
    value = np.minimum(np.interp(x, place, share) + outside, 0.0)
    return value, np.where(value < 0.0, slope, 0.0)


def _on_curves(curves: PchipInterpolator, x: FloatArray) -> FloatArray:
    """``exp`` of every curve at its own ``x``, ``(n,)``."""
    knots = curves.x
    piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, knots.size - 2)
    a, b, c, d = curves.c[:, piece, np.arange(x.size)]
    h = x - knots[piece]
    return np.asarray(np.exp(((a * h + b) * h + c) * h + d))


def von_mises_slope(stress: FloatArray) -> FloatArray:
    """Derivative of the von Mises stress by Voigt stresses ``(6, ...)``; zero without stress."""
    mean = stress[:3].mean(axis=0)
    slope = np.concatenate([1.5 * (stress[:3] - mean), 3.0 * stress[3:]])
    size = np.sqrt((slope[:3] ** 2).sum(axis=0) / 1.5 + (slope[3:] ** 2).sum(axis=0) / 3.0)
    return np.divide(slope, size, out=np.zeros_like(slope), where=size > 0)
