"""Laws of the cells of every element: one law everywhere, or mixes of several.

Arrays run over the elements, in their order. An element whose cells mix is as stiff as the weighted
mean of the stiffnesses of its cells at its density, times a factor, and its local stress is the
weighted mean of theirs over another: the factors are what homogenised mixes have of these means.
Longer than 300 lines, since every property of a law has its mean here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.special import expit, logit

from gradedesign.arrays import FloatArray, IntArray, locked
from gradedesign.mechanics.material.density_from_stress import density_from_stress
from gradedesign.mechanics.material.local_stress_law import von_mises_slope
from gradedesign.mechanics.material.long_waves import long_wave_slopes, long_wave_use
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: Relative width of the local stress in an element whose law has one number for it, by which a
#: percentile depends on more than one element. With 0.005 sizing of an L of 400 elements swings by
#: 1 % about its limit; with 0.03 it settles.
SPREAD = 0.03
#: Multiples of the local stress below this are none: keeps logarithms finite.
_NO_STRESS = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LawField:
    """Laws with their weights in every element."""

    laws: tuple[ScalingLaw, ...]
    #: ``(n, M)``. Of every law, together 1; None: there is one law, which holds everywhere.
    weights: FloatArray | None = None
    #: ``(M,)``. Of a mix over the mean of its cells, 1 where one cell is alone; None with one law.
    stiffness_factor: FloatArray | None = None
    strength_factor: FloatArray | None = None

    def __post_init__(self) -> None:
        if (self.weights is None) != (len(self.laws) == 1):
            raise ValueError(f"{len(self.laws)} laws need weights, one law needs none")
        if self.weights is None:
            return
        weights = locked(self.weights, (len(self.laws), None), name="weights")
        object.__setattr__(self, "weights", weights)
        for name in ("stiffness_factor", "strength_factor"):
            value = locked(getattr(self, name), (weights.shape[1],), name=name)
            object.__setattr__(self, name, value)

    @property
    def window(self) -> tuple[FloatArray, FloatArray]:
        """Densities between which all laws of an element are supported, scalars or ``(M,)``."""
        if self.weights is None:
            low, high = self.laws[0].window
            return np.asarray(low), np.asarray(high)
        ends = np.array([law.window for law in self.laws])[:, :, None]
        used = self.weights > 0
        return (
            np.where(used, ends[:, 0], 0.0).max(axis=0),
            np.where(used, ends[:, 1], 1.0).min(axis=0),
        )

    @property
    def needs_von_mises(self) -> bool:
        """Whether a law predicts local stress from the macroscopic von Mises stress."""
        return any(law.local_stress is None for law in self.laws)

    @property
    def knows_distribution(self) -> bool:
        """Whether a law knows how local stress is distributed inside a cell."""
        return any(
            law.local_stress is not None and law.local_stress.has_distribution for law in self.laws
        )

    @property
    def buckling_window(self) -> tuple[FloatArray, FloatArray]:
        """Densities between which critical stresses were computed, scalars or ``(M,)``.

        Of all laws of an element that know waves of one or two cells; 0 and infinite without any.
        """
        ends = np.array(
            [(0.0, np.inf) if w.buckling is None else w.buckling.window for w in self.laws]
        )
        if self.weights is None:
            return np.asarray(ends[0, 0]), np.asarray(ends[0, 1])
        used = self.weights > 0
        return (
            np.where(used, ends[:, :1], 0.0).max(axis=0),
            np.where(used, ends[:, 1:], np.inf).min(axis=0),
        )

    def among(self, used: IntArray) -> LawField:
        """The field of some elements, by their indices."""
        if self.weights is None:
            return self
        return replace(
            self,
            weights=self.weights[:, used],
            stiffness_factor=np.asarray(self.stiffness_factor)[used],
            strength_factor=np.asarray(self.strength_factor)[used],
        )

    def stiffness(self, rho: FloatArray) -> FloatArray:
        """Relative stiffness at densities ``(M,)`` in the axes of the cells, ``(6, 6, M)``."""
        return self._mean([law.stiffness for law in self.laws], rho)

    def stiffness_derivative(self, rho: FloatArray) -> FloatArray:
        """d(stiffness)/d(rho), ``(6, 6, M)``."""
        return self._mean([law.stiffness_derivative for law in self.laws], rho)

    def _mean(
        self, curves: Sequence[Callable[[FloatArray], FloatArray]], rho: FloatArray
    ) -> FloatArray:
        """Weighted mean of a curve of every law, times the factor on stiffness, ``(6, 6, M)``."""
        if self.weights is None:
            return curves[0](rho)
        total = np.zeros((6, 6, rho.size))
        for curve, (_, at, weight) in zip(curves, self._parts(), strict=True):
            total[:, :, at] += weight * curve(rho[at])
        return np.asarray(total * np.asarray(self.stiffness_factor))

    def stress_profile(
        self,
        stress: FloatArray | None,
        von_mises: FloatArray | None,
        rho: FloatArray | None = None,
    ) -> FloatArray:
        """Local factors of a macroscopic stress for `local_stress`, rows of every law in turn.

        ``stress (6, M, q)``: in the axes of the cells; needed where a law knows local stress.
        ``von_mises (M, q)``: macroscopic; needed where a law does not. ``rho (M,)``: the densities
        at which alone the local stress is asked for; None: at any. Returns ``(k, M)``: means
        over the q points; 0 where a law has no weight.
        """
        blocks = []
        for law, at, _ in self._parts():
            if law.local_stress is not None and stress is not None:
                near = None if rho is None else rho[at]
                block = law.local_stress.profile(stress[:, at], near).mean(axis=-1)
            elif von_mises is not None:
                block = von_mises[at].mean(axis=1)[None]
            else:
                raise ValueError(f"law '{law.name}' needs the other measure of stress")
            blocks.append(self._spread(block, at))
        return np.concatenate(blocks)

    def local_stress(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Local von Mises stress in the solid at densities ``(M,)``, ``(M,)``."""
        local = np.zeros(rho.size)
        for (law, at, weight), rows in zip(self._parts(rho.size), self._stress_rows(), strict=True):
            if law.local_stress is None:
                value = profile[rows.start, at] / law.strength(rho[at])
            else:
                value = law.local_stress.at(profile[rows, at], rho[at])
            local[at] += weight * value
        return local if self.strength_factor is None else np.asarray(local / self.strength_factor)

    def local_slopes(
        self, profile: FloatArray, rho: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Local stress ``(M,)``, and its derivatives by density and by the profile ``(k, M)``."""
        local, by_rho = np.zeros(rho.size), np.zeros(rho.size)
        by_profile = np.zeros(profile.shape)
        factor = self.strength_factor
        for (law, at, weight), rows in zip(self._parts(rho.size), self._stress_rows(), strict=True):
            share = weight if factor is None else weight / factor[at]
            if law.local_stress is None:
                # Differences of a law that states no derivative: 1e-6 of density, its rounding.
                step = 1e-6 * rho[at]
                below, above = (np.clip(rho[at] + s * step, *law.window) for s in (-1.0, 1.0))
                rise = law.strength(above) - law.strength(below)
                strength = law.strength(rho[at])
                value = profile[rows.start, at] / strength
                by_rho[at] -= share * value * rise / ((above - below) * strength)
                by_profile[rows.start, at] = share / strength
            else:
                value, slope, by = law.local_stress.slopes(profile[rows, at], rho[at])
                by_rho[at] += share * slope
                by_profile[rows, at] = share * by
            local[at] += share * value
        return local, by_rho, by_profile

    def stress_slope(self, stress: FloatArray, by_profile: FloatArray) -> FloatArray:
        """Derivative by stress ``(6, M, q)`` of what depends on its profile ``(k, M)``.

        ``by_profile`` holds the derivatives by the profile of `stress_profile`.
        """
        slope = np.zeros(stress.shape)
        for (law, at, _), rows in zip(self._parts(), self._stress_rows(), strict=True):
            weight = by_profile[rows, at]
            if law.local_stress is None:
                part = von_mises_slope(stress[:, at]) * (weight[0][:, None] / stress.shape[2])
            else:
                part = law.local_stress.stress_slope(stress[:, at], weight)
            slope[:, at] += part
        return slope

    def density_for_stress(self, profile: FloatArray, permitted: float) -> FloatArray:
        """Density that keeps the local stress of every cell of an element permitted, ``(M,)``.

        Of a mix the densest that one of its cells asks for, which is enough for the mean. The top
        of the law's window where that is not enough.
        """
        least = np.zeros(profile.shape[1])
        factor = self.strength_factor
        for (law, at, _), rows in zip(
            self._parts(profile.shape[1]), self._stress_rows(), strict=True
        ):
            block = profile[rows, at] if factor is None else profile[rows, at] / factor[at]
            if law.local_stress is None:
                wanted = density_from_stress(law, block[0], permitted)
            else:
                wanted = law.local_stress.least_density(block, permitted, law.window)
            least[at] = np.maximum(least[at], wanted)
        return least

    def volume_slopes(
        self, stress_share: FloatArray, rho: FloatArray, beyond: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Share of the solid of an element above a multiple of its local stress, ``(M,)``.

        With its derivatives by the logarithm of the multiple and by density, as
        `LocalStressLaw.volume_slopes`; of a mix the mean over its cells. A law that knows no
        distribution has one local stress in an element, with a spread of `SPREAD`, which the share
        ``beyond`` of the element exceeds.
        """
        share, by_stress, by_rho = (np.zeros(rho.size) for _ in range(3))
        for law, at, weight in self._parts(rho.size):
            if law.local_stress is None or not law.local_stress.has_distribution:
                above = expit(
                    logit(beyond) - np.log(np.maximum(stress_share[at], _NO_STRESS)) / SPREAD
                )
                parts = (above, -above * (1 - above) / SPREAD, 0.0 * above)
            else:
                parts = law.local_stress.volume_slopes(stress_share[at], rho[at])
            for total, part in zip((share, by_stress, by_rho), parts, strict=True):
                total[at] += weight * part
        return share, by_stress, by_rho

    def buckling_profile(self, relative: FloatArray) -> FloatArray:
        """Buckling measures of stresses ``(6, M, q)`` over Young's modulus, ``(b, M)``.

        Uses in short waves at the densities of every law that knows them, means over the q points,
        and in the last six rows the mean stress, which long waves feel. In proportion to stress.
        """
        blocks = []
        for law, at, _ in self._parts():
            if law.buckling is not None:
                block = law.buckling.profile(relative[:, at]).mean(axis=-1)
                blocks.append(self._spread(block, at))
        return np.concatenate([*blocks, relative.mean(axis=-1)])

    def buckling(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Utilisation of the resistance against buckling in short and in long waves, ``(2, M)``.

        The greater of both is that of the cells. Of a mix that of its worst cell over the factor on
        stiffness, which is an estimate: modes of mixes were not searched.
        """
        use = self._worst_cell(profile, rho)
        return use if self.stiffness_factor is None else np.asarray(use / self.stiffness_factor)

    def _worst_cell(self, profile: FloatArray, rho: FloatArray) -> FloatArray:
        """Greatest utilisations of the cells of an element, each alone, ``(2, M)``."""
        use = np.zeros((2, rho.size))
        for (law, at, _), rows in zip(self._parts(rho.size), self._buckling_rows(), strict=True):
            if law.buckling is not None:
                use[0, at] = np.maximum(use[0, at], law.buckling.at(profile[rows, at], rho[at]))
            use[1, at] = np.maximum(use[1, at], long_wave_use(law, profile[-6:, at], rho[at]))
        return use

    def buckling_slopes(
        self, profile: FloatArray, rho: FloatArray, by_use: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives by the profile ``(b, M)`` and density ``(M,)`` of those by `buckling`.

        ``by_use (2, M)`` holds the derivatives by the uses in short and in long waves. Of a mix
        they are those of its worst cell.
        """
        by_profile, by_rho = np.zeros(profile.shape), np.zeros(rho.size)
        worst = self._worst_cell(profile, rho)
        if self.stiffness_factor is not None:
            by_use = by_use / self.stiffness_factor
        for (law, at, _), rows in zip(self._parts(rho.size), self._buckling_rows(), strict=True):
            if law.buckling is not None:
                use, slope, by = law.buckling.slopes(profile[rows, at], rho[at])
                governs = by_use[0, at] * (use >= worst[0, at])
                by_rho[at] += governs * slope
                by_profile[rows, at] += governs * by
            stress, density = profile[-6:, at], rho[at]
            governs = by_use[1, at] * (long_wave_use(law, stress, density) >= worst[1, at])
            by_stress, slope = long_wave_slopes(law, stress, density)
            by_rho[at] += governs * slope
            by_profile[-6:, at] += governs * by_stress
        return by_profile, by_rho

    def buckling_stress_slope(self, stress: FloatArray, by_profile: FloatArray) -> FloatArray:
        """Derivative by stress ``(6, M, q)`` of what depends on its `buckling_profile`."""
        slope = np.repeat(by_profile[-6:, :, None] / stress.shape[2], stress.shape[2], axis=2)
        for (law, at, _), rows in zip(self._parts(), self._buckling_rows(), strict=True):
            if law.buckling is not None:
                slope[:, at] += law.buckling.stress_slope(stress[:, at], by_profile[rows, at])
        return slope

    def _parts(self, count: int = 0) -> Iterator[tuple[ScalingLaw, slice | IntArray, FloatArray]]:
        """Every law with the elements in which it has a weight, and these weights."""
        if self.weights is None:
            yield self.laws[0], slice(None), np.ones(count)
            return
        for law, weights in zip(self.laws, self.weights, strict=True):
            at = np.flatnonzero(weights > 0)
            yield law, at, weights[at]

    def _spread(self, block: FloatArray, at: slice | IntArray) -> FloatArray:
        """Rows of some elements as rows of all, 0 elsewhere."""
        if self.weights is None:
            return block
        rows = np.zeros((block.shape[0], self.weights.shape[1]))
        rows[:, at] = block
        return rows

    def _stress_rows(self) -> list[slice]:
        """Rows of every law in a profile of stress."""
        counts = [1 if w.local_stress is None else w.local_stress.density.size for w in self.laws]
        return _blocks(counts)

    def _buckling_rows(self) -> list[slice]:
        """Rows of every law in a profile of buckling, without the stress."""
        counts = [0 if w.buckling is None else w.buckling.table.density.size for w in self.laws]
        return _blocks(counts)


def _blocks(counts: list[int]) -> list[slice]:
    ends = np.cumsum([0, *counts]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]
