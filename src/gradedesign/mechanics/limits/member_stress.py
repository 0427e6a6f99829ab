"""Stress in solid members, which sizing makes among the lattice.

Members and lattice of a tetrahedron are strained alike: the members' stress is that of the base
material under this strain. Judged as a percentile by volume, as stress in every other phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gradedesign.mechanics.limits.percentile_limit import PercentileLimit
from gradedesign.mechanics.limits.state import HomogenisedState, Response
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
class MemberStressLimit(PercentileLimit):
    """Von Mises stress in solid members."""

    may_lack: ClassVar[bool] = True

    def judges(self, phase: str) -> bool:
        """Members alone."""
        return phase == PHASE

    def volume_percentile(self, state: HomogenisedState, load_case: str) -> VolumePercentile:
        """Of the stress in members; 0 where there are none."""
        volumes = state.member_volumes * self.evaluated
        stress, solid = state.solid_stress(load_case), np.ones(volumes.shape)
        return volume_percentile(stress, solid, volumes, _SOLID, self.percentile)

    def response(
        self, state: HomogenisedState, found: VolumePercentile, load_case: str
    ) -> Response:
        """That percentile with its derivatives through strain and volumes."""
        by_displacement = state.through_solid_stress(load_case, found.by_local)
        by_design = state.by_member_volume(found.by_volume * self.evaluated)
        return Response(
            name=self.name,
            load_case=load_case,
            value=self.factor * found.value,
            by_displacement=self.factor * by_displacement,
            by_design=self.factor * by_design,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BodyStressLimit(MemberStressLimit):
    """Von Mises stress in a body without cells: in members, and in what is solid beside them."""

    may_lack: ClassVar[bool] = False

    def judges(self, phase: str) -> bool:  # noqa: ARG002
        """Every phase."""
        return True
