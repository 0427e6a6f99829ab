"""Local stress: von Mises stress in the solid of the lattice must stay below a limit.

Judged as a percentile by volume outside the exclusion radius, in every phase of the printed solid;
the lattice's is predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gradedesign.arrays import BoolArray, locked
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.analysis import Analysis, PhaseStress, SubmodelStress
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.member_stress import PHASE, MemberStressLimit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.limits.volume_percentile import VolumePercentile, volume_percentile
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: A radius that leaves out more of the lattice's volume than this gives a warning. Chosen, not
#: measured.
_MOST_LEFT_OUT = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressLimit(Limit):
    """Von Mises stress in the solid material of the lattice, the largest of all load cases.

    Attributes
    ----------
    percentile : float
        Volume percentile that is judged.
    evaluated : (M,) bool array
        Tetrahedra of the part outside the exclusion radius of supports.
    judged : float
        Share of the lattice's region outside it.
    apart : tuple of str
        Phases that other limits judge.
    """

    percentile: float
    evaluated: BoolArray
    judged: float = 1.0
    apart: tuple[str, ...] = ()

    unit: ClassVar[str] = "MPa"
    needs_stress: ClassVar[bool] = True
    by_gradient: ClassVar[bool] = True
    scatter: ClassVar[float] = 1.03

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "evaluated", locked(self.evaluated, (None,), dtype=np.bool_, name="evaluated")
        )

    @property
    def measure(self) -> str:
        """The percentile by volume, outside the exclusion radius."""
        return f"percentile {self.percentile:g} of the volume outside the exclusion radius"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Volume percentile of the predicted local stress over the evaluated lattice, MPa.

        The largest of the load cases, as explicit analyses are judged.
        """
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
        return tuple(self._response(state, *each) for each in found), memory

    def _percentile(self, state: HomogenisedState, load_case: str) -> VolumePercentile:
        weights = state.lattice_volumes * self.evaluated
        return volume_percentile(
            state.local_stress(load_case),
            state.effective_density,
            weights,
            state.law,
            self.percentile,
        )

    def _response(
        self, state: HomogenisedState, found: VolumePercentile, load_case: str
    ) -> Response:
        by_displacement, by_density = state.through_local_stress(load_case, found.by_local)
        by_design = state.by_density(by_density)
        by_design += state.by_design(found.by_density, found.by_volume * self.evaluated)
        return Response(
            name=self.name,
            load_case=load_case,
            value=self.factor * found.value,
            by_displacement=self.factor * by_displacement,
            by_design=self.factor * by_design,
        )

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The largest percentile of every phase, MPa."""
        found: dict[str, list[tuple[str, PhaseStress]]] = {}
        for name, measures in analysis.measures.items():
            for each in measures:
                if each.phase in self.apart:
                    continue
                found.setdefault(each.phase, []).append((name, each))
        governing = {
            phase: max(entries, key=lambda entry: (_decisive(entry[1]), entry[0]))
            for phase, entries in found.items()
        }
        return tuple(
            replace(
                self.row(measure.value, judged_by, load_case=load_case),
                key=replace(self.key, region=phase),
                name=f"stress in {phase}",
                phase=phase,
                judged=analysis.judged_share,
                band=measure.band,
                largest=measure.maximum,
            )
            for phase, (load_case, measure) in governing.items()
        )

    def row(
        self, value: float, judged_by: str, *, load_case: str = "", homogenised: bool = False
    ) -> LimitRow:
        """The row of a value, with the share of the lattice's region that it judges."""
        made = Limit.row(self, value, judged_by, load_case=load_case, homogenised=homogenised)
        return replace(made, judged=self.judged)

    def submodel_factor(self, submodels: Sequence[SubmodelStress]) -> Banded | None:
        """The largest ratio of any submodel.

        One that misses its criterion is judged on the worse of the two analyses, with their
        difference as its band.
        """
        ends = [
            (min(ratio, 1.0), max(ratio, 1.0)) if not submodel.matches else (ratio, ratio)
            for submodel in submodels
            for ratio in [submodel.value / submodel.driving_value]
        ]
        low, high = max(end[0] for end in ends), max(end[1] for end in ends)
        return Banded(value=high, low=low, high=high)


def _decisive(measure: PhaseStress) -> float:
    """The unfavourable end of the band; the value where there is none."""
    return measure.value if measure.band is None else measure.band.high


def allowed_stress(limits: LimitsSpec, material: Material) -> float | None:
    """Allowed von Mises stress, MPa; None where none is stated."""
    if limits.safety_factor is not None:
        return material.yield_strength / limits.safety_factor
    return limits.stress


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    allowed, percentile = allowed_stress(limits, placed.material), limits.percentile
    if allowed is None:
        return (), ()
    room = placed.lattice_volumes
    total = float(room.sum())
    share = float(room[~placed.evaluated].sum() / total) if total > 0 else 0.0
    limit = StressLimit(
        key=LimitKey(kind=KIND.name, region="lattice"),
        name="stress in lattice",
        allowed=allowed,
        percentile=percentile,
        evaluated=placed.evaluated,
        judged=1.0 - share,
        apart=(PHASE,) if placed.members else (),
    )
    members = MemberStressLimit(
        key=LimitKey(kind=KIND.name, region=PHASE),
        name=f"stress in {PHASE}",
        allowed=allowed,
        percentile=percentile,
        evaluated=placed.evaluated,
    )
    return (limit, members) if placed.members else (limit,), (
        *(w for law in placed.law.laws for w in percentile_warnings(law, percentile)),
        *share_warnings(share, placed.exclusion_radius),
    )


def percentile_warnings(law: ScalingLaw, percentile: float) -> tuple[str, ...]:
    """Warn where the law predicts another percentile than the judged one."""
    stress_law = law.local_stress
    if stress_law is None or stress_law.has_distribution or stress_law.percentile == percentile:
        return ()
    return (
        f"stress is judged at the {percentile:g}th percentile by volume, but the strength surfaces "
        f"of law '{law.name}' stand for the {stress_law.percentile:g}th: the first prediction "
        f"is off by that, later ones are corrected",
    )


def share_warnings(share: float, radius: float) -> tuple[str, ...]:
    """Warn where the exclusion radius, mm, leaves out more than `_MOST_LEFT_OUT` of the lattice."""
    if share <= _MOST_LEFT_OUT:
        return ()
    return (
        f"the exclusion radius of {radius:.4g} mm around supports leaves {share:.0%} of the "
        f"latticed region out of the stress limit; the report shows the stress with it, and a "
        f"smaller [limits] exclusion_radius leaves out less",
    )


def _stated(
    limits: LimitsSpec, _load_cases: Sequence[LoadCaseSpec], material: Material
) -> Sequence[StatedLimit]:
    allowed = allowed_stress(limits, material)
    if allowed is None:
        return ()
    return (StatedLimit(name="stress", load_case="every", allowed=f"{allowed:.4g} MPa"),)


#: Stress in the solid material, ``stress = "50 MPa"`` or ``safety_factor = 2``.
KIND = LimitKind(name="stress", make=_make, stated=_stated)
