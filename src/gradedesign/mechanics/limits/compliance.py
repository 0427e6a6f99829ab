"""Compliance: the work of the loads on the displacements that they cause must stay below a limit.

Force times displacement, twice the strain energy of rigidly held, unheated parts. Inertia counts as
a load; reactions of supports that are moved and thermal forces do not. A load case without loads is
not judged: its work is zero, whatever the lattice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gradedesign.common.values.locate import Where
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import (
    Allowed,
    LimitEntry,
    LimitsSpec,
    SolidMultiple,
    as_multiple,
    in_number,
    stated_words,
)
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.material import Material


class ComplianceEntry(LimitEntry):
    """Largest work of the loads of a load case."""

    work: Annotated[float | SolidMultiple, Allowed("work")] = Field(
        examples=["120 N mm", "1.5 x solid"]
    )
    """Allowed work: N mm, or so many times that of the solid part, each load case its own."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComplianceLimit(Limit):
    """Work of the loads of one load case."""

    unit: ClassVar[str] = "N mm"
    converges: ClassVar[bool] = True

    @property
    def measure(self) -> str:
        """Force times displacement."""
        return "nodal forces times displacements"

    def predict(self, state: HomogenisedState) -> Predicted:
        """Work of the loads, N mm."""
        name = self.key.load_case
        work = float((state.force(name) * state.displacement(name)).sum())
        return Predicted(value=self.factor * work, load_case=name)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """Derivatives of ``f . u`` by the displacements and, through f, by the design."""
        name = self.key.load_case
        force, u = state.force(name), state.displacement(name)
        response = Response(
            name=self.name,
            load_case=name,
            value=self.factor * float((force * u).sum()),
            by_displacement=self.factor * force,
            by_design=self.factor * state.force_slope(name, u),
        )
        return (response,)

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """Work of the loads, N mm."""
        return (self.row(analysis.work[self.key.load_case], judged_by),)


def _entries(limits: Any) -> Sequence[ComplianceEntry]:
    entries: Sequence[ComplianceEntry] = limits.compliance
    return entries


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[Sequence[Limit], Sequence[str]]:
    made, warnings = [], []
    for number, entry in enumerate(_entries(limits)):
        for load in entry.judged(placed.load_cases):
            if not load.has_forces:
                warnings.append(
                    f"work of the loads is not judged in load case '{load.name}', which has no "
                    f"loads, only heat or moved supports"
                )
                continue
            made.append(
                ComplianceLimit(
                    key=LimitKey(kind=KIND.name, load_case=load.name),
                    name="work of the loads",
                    allowed=in_number(entry.work),
                    times_solid=as_multiple(entry.work),
                    case_key=f"limits.compliance[{number}].work",
                )
            )
    return made, warnings


def _stated(
    limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], _material: Material
) -> Sequence[StatedLimit]:
    return [
        StatedLimit(
            name="work of the loads",
            load_case=load.name,
            allowed=stated_words(entry.work, ComplianceLimit.unit),
        )
        for entry in _entries(limits)
        for load in entry.judged(load_cases)
        if load.has_forces
    ]


def _require(
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    _regions: Mapping[str, Region],
    where: Where,
) -> None:
    """Refuse entries all of whose load cases have no loads."""
    for number, entry in enumerate(_entries(limits)):
        cases = entry.judged(load_cases)
        if any(load.has_forces for load in cases):
            continue
        names = ", ".join(f"'{load.name}'" for load in cases)
        which, have = ("load case", "has") if len(cases) == 1 else ("load cases", "have")
        raise CaseError(
            f"{where(f'limits.compliance[{number}]')}: {which} {names} {have} no force, "
            f"pressure, moment or acceleration, so the work of the loads is 0 N mm whatever the "
            f"lattice; expected a load case with loads; what heat or moved supports do to the "
            f"part is limited by displacement or stress"
        )


#: Compliance, ``compliance = [{load_case = "pull", work = "120 N mm"}]``.
KIND = LimitKind(
    name="compliance", entry=ComplianceEntry, make=_make, stated=_stated, require=_require
)
