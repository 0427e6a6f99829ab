"""Limits on stress: a percentile by volume, the largest of all load cases."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gradedesign.arrays import BoolArray, locked
from gradedesign.mechanics.limits.analysis import Analysis, PhaseStress
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.limits.volume_percentile import VolumePercentile


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PercentileLimit(Limit):
    """Von Mises stress in one phase or several, judged apart."""

    percentile: float  #: Volume percentile that is judged.
    #: ``(M,)``. Tetrahedra of the part outside the exclusion radius of supports.
    evaluated: BoolArray
    cycle: str = ""  #: How often the loads come and go, in words; empty: they act once.

    unit: ClassVar[str] = "MPa"
    needs_stress: ClassVar[bool] = True
    scatter: ClassVar[float] = 1.03

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "evaluated", locked(self.evaluated, (None,), dtype=np.bool_, name="evaluated")
        )

    @property
    def measure(self) -> str:
        """The percentile by volume, outside the exclusion radius."""
        words = f"percentile {self.percentile:g} of the volume outside the exclusion radius"
        return f"{words}, at the largest load of the cycle" if self.cycle else words

    @property
    def stated(self) -> str:
        """The cycles that the allowed stress is borne for."""
        return self.cycle

    def _judged_cases(self, names: Iterable[str]) -> list[str]:
        """Load cases that it judges: its own, or all."""
        return [name for name in names if self.key.load_case in ("", name)]

    @abstractmethod
    def volume_percentile(self, state: HomogenisedState, load_case: str) -> VolumePercentile:
        """The predicted percentile of one load case, MPa, with its derivatives."""

    @abstractmethod
    def response(
        self, state: HomogenisedState, found: VolumePercentile, load_case: str
    ) -> Response:
        """That percentile with its derivatives by displacements and by the design."""

    @abstractmethod
    def judges(self, phase: str) -> bool:
        """Whether it judges a phase of the printed solid."""

    def predict(self, state: HomogenisedState) -> Predicted:
        """Volume percentile of the predicted stress over the evaluated volume, MPa.

        The largest of the load cases, as explicit analyses are judged.
        """
        value, load_case = max(
            (self.volume_percentile(state, name).value, name)
            for name in self._judged_cases(state.load_cases)
        )
        return Predicted(value=self.factor * value, load_case=load_case)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """The percentile in every load case, the largest first."""
        names = self._judged_cases(state.load_cases)
        found = [(self.volume_percentile(state, name), name) for name in names]
        found.sort(key=lambda each: -each[0].value)
        return tuple(self.response(state, *each) for each in found)

    def hot_spots(self, analysis: Analysis) -> tuple[str, ...]:
        """The largest stress in a phase, where loads come and go: a crack starts there first."""
        if not self.cycle:
            return ()
        return tuple(
            f"{self.key.kind} in {each.phase} ({name}): a hot spot at "
            f"({', '.join(f'{c:.1f}' for c in each.maximum_place)}) mm has {each.maximum:.4g} MPa "
            f"at the largest load of the cycle, more than the allowed {self.allowed:.4g} MPa "
            f"({self.cycle}); the judged percentile may pass over it, a crack does not"
            for name in self._judged_cases(analysis.measures)
            for each in analysis.measures[name]
            if self.judges(each.phase) and each.maximum > self.allowed and each.maximum_place
        )

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The largest percentile of every phase that it judges, MPa."""
        found: dict[str, list[tuple[str, PhaseStress]]] = {}
        for name in self._judged_cases(analysis.measures):
            for each in analysis.measures[name]:
                if self.judges(each.phase):
                    found.setdefault(each.phase, []).append((name, each))
        governing = {
            phase: max(entries, key=lambda entry: (_decisive(entry[1]), entry[0]))
            for phase, entries in found.items()
        }
        return tuple(
            replace(
                self.row(measure.value, judged_by, load_case=load_case),
                key=replace(self.key, region=phase),
                name=f"{self.key.kind} in {phase}",
                phase=phase,
                judged=analysis.judged_share,
                band=measure.band,
                largest=measure.maximum,
            )
            for phase, (load_case, measure) in governing.items()
        )


def _decisive(measure: PhaseStress) -> float:
    """The unfavourable end of the band; the value where there is none."""
    return measure.value if measure.band is None else measure.band.high
