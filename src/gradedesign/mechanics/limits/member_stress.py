"""Stress in solid members, which sizing makes among the lattice.

Members and lattice of a tetrahedron are strained alike: the members' stress is that of the base
material under this strain. Judged as a percentile by volume, as stress in every other phase.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gradedesign.arrays import BoolArray, locked
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.limits.volume_percentile import VolumePercentile, volume_percentile
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin

#: Phase of members in analyses, an entry of ``explicit.measures.PHASES``.
PHASE = "solid members"
#: Solid has one stress in a tetrahedron: no distribution inside cells.
_SOLID = LawField(
    laws=(
        power_law(
            "solid", ("solid",), youngs=(1.0, 1.0), window=(0.5, 1.0),
            origin=LawOrigin(kind="fe", source="the base material", test="none"),
        ),
    )
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MemberStressLimit(Limit):
    """Von Mises stress in solid members, the largest of all load cases.

    Attributes
    ----------
    percentile : float
        Volume percentile that is judged.
    evaluated : (M,) bool array
        Tetrahedra of the part outside the exclusion radius of supports.
    """

    percentile: float
    evaluated: BoolArray

    unit: ClassVar[str] = "MPa"
    needs_stress: ClassVar[bool] = True
    by_gradient: ClassVar[bool] = True
    scatter: ClassVar[float] = 1.03
    may_lack: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "evaluated", locked(self.evaluated, (None,), dtype=np.bool_, name="evaluated")
        )

    @property
    def measure(self) -> str:
        """The percentile by volume, outside the exclusion radius."""
        return f"percentile {self.percentile:g} of the volume outside the exclusion radius"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Volume percentile of the stress in members, MPa; 0 where there are none."""
        value, load_case = max(
            (self._percentile(state, name).value, name) for name in state.load_cases
        )
        return Predicted(value=self.factor * value, load_case=load_case)

    def responses(
        self, state: HomogenisedState, memory: tuple[int, ...] = ()
    ) -> tuple[tuple[Response, ...], tuple[int, ...]]:
        """The percentile in every load case, the largest first."""
        found = [(self._percentile(state, name), name) for name in state.load_cases]
        found.sort(key=lambda each: -each[0].value)
        return tuple(
            Response(
                name=self.name,
                load_case=name,
                value=self.factor * percentile.value,
                by_displacement=self.factor * state.through_solid_stress(name, percentile.by_local),
                by_design=self.factor
                * state.by_member_volume(percentile.by_volume * self.evaluated),
            )
            for percentile, name in found
        ), memory

    def _percentile(self, state: HomogenisedState, load_case: str) -> VolumePercentile:
        volumes = state.member_volumes * self.evaluated
        solid = np.ones(volumes.shape)
        stress = state.solid_stress(load_case)
        return volume_percentile(stress, solid, volumes, _SOLID, self.percentile)

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The largest percentile of members, MPa; none where there are none."""
        found = [
            (each.value if each.band is None else each.band.high, name, each)
            for name, measures in analysis.measures.items()
            for each in measures
            if each.phase == PHASE
        ]
        if not found:
            return ()
        _, load_case, measure = max(found, key=lambda entry: entry[:2])
        row = self.row(measure.value, judged_by, load_case=load_case)
        return (
            replace(
                row,
                phase=PHASE,
                judged=analysis.judged_share,
                band=measure.band,
                largest=measure.maximum,
            ),
        )
