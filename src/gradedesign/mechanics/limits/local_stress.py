"""Local stress: von Mises stress in the solid of the lattice must stay below a limit.

Judged as a percentile by volume outside the exclusion radius, in every phase of the printed solid;
the lattice's is predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.analysis import SubmodelStress
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.member_stress import PHASE, BodyStressLimit, MemberStressLimit
from gradedesign.mechanics.limits.percentile_limit import PercentileLimit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Response
from gradedesign.mechanics.limits.volume_percentile import VolumePercentile, volume_percentile
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: A radius that leaves out more of the lattice's volume than this gives a warning. Chosen, not
#: measured.
_MOST_LEFT_OUT = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressLimit(PercentileLimit):
    """Von Mises stress in the solid material of the lattice, and of solids beside it."""

    judged: float = 1.0  #: Share of the lattice's region outside the exclusion radius.
    apart: tuple[str, ...] = ()  #: Phases that other limits judge.

    def judges(self, phase: str) -> bool:
        """Every phase that no other limit judges."""
        return phase not in self.apart

    def volume_percentile(self, state: HomogenisedState, load_case: str) -> VolumePercentile:
        """Of the local stress in the solid of the lattice."""
        return volume_percentile(
            state.local_stress(load_case),
            state.effective_density,
            state.lattice_volumes * self.evaluated,
            state.law,
            self.percentile,
        )

    def response(
        self, state: HomogenisedState, found: VolumePercentile, load_case: str
    ) -> Response:
        """That percentile with its derivatives through local stress, densities and volumes."""
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


def allowed_stress(limits: LimitsSpec, material: Material) -> float | None:
    """Least von Mises stress that a limit allows, MPa; None where none is stated."""
    stated = [] if (once := _allowed_once(limits, material)) is None else [once]
    stated += [entry.allowed(material) for entry in getattr(limits, "fatigue", ())]
    return min(stated, default=None)


def _allowed_once(limits: LimitsSpec, material: Material) -> float | None:
    """Allowed von Mises stress of loads that act once, MPa; None where none is stated."""
    if limits.safety_factor is not None:
        return material.yield_strength / limits.safety_factor
    return limits.stress


def stress_limits(
    limits: LimitsSpec,
    placed: PlacedModel,
    allowed: float,
    *,
    kind: str,
    load_case: str = "",
    cycle: str = "",
) -> tuple[Sequence[PercentileLimit], Sequence[str]]:
    """Limits on the stress in the lattice and in solid members, and their warnings.

    ``allowed``, MPa. ``load_case``: the only one that is judged; all without it. ``cycle``: how
    often its loads act, in words.
    """
    percentile = limits.percentile

    def made(limit: type[PercentileLimit], phase: str, **more: Any) -> PercentileLimit:
        return limit(
            key=LimitKey(kind=kind, region=phase, load_case=load_case),
            name=f"{kind} in {phase}",
            allowed=allowed,
            percentile=percentile,
            evaluated=placed.evaluated,
            cycle=cycle,
            **more,
        )

    if not placed.cells:
        return (made(BodyStressLimit, PHASE),), ()
    room = placed.lattice_volumes
    total = float(room.sum())
    share = float(room[~placed.evaluated].sum() / total) if total > 0 else 0.0
    apart = (PHASE,) if placed.members else ()
    lattice = made(StressLimit, "lattice", judged=1.0 - share, apart=apart)
    return (lattice, *(made(MemberStressLimit, phase) for phase in apart)), (
        *(w for law in placed.law.laws for w in percentile_warnings(law, percentile)),
        *share_warnings(share, placed.exclusion_radius),
    )


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    allowed = _allowed_once(limits, placed.material)
    return ((), ()) if allowed is None else stress_limits(limits, placed, allowed, kind=KIND.name)


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
    allowed = _allowed_once(limits, material)
    if allowed is None:
        return ()
    return (StatedLimit(name="stress", load_case="every", allowed=f"{allowed:.4g} MPa"),)


#: Stress in the solid material, ``stress = "50 MPa"`` or ``safety_factor = 2``.
KIND = LimitKind(name="stress", make=_make, stated=_stated)
