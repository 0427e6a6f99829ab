"""Local stress: von Mises stress in the solid of the lattice must stay below a limit.

Judged as a percentile by volume outside the exclusion radius, in every phase of the printed solid;
the lattice's is predicted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    solid = MemberStressLimit if placed.cells else BodyStressLimit
    members = solid(
        key=LimitKey(kind=KIND.name, region=PHASE),
        name=f"stress in {PHASE}",
        allowed=allowed,
        percentile=percentile,
        evaluated=placed.evaluated,
    )
    if not placed.cells:
        return (members,), ()
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
