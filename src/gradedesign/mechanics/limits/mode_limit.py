"""Limits on modes of the part, natural frequencies and factors of loads: what they have in common.

The part is judged as a whole: of a half of it, mirrored at a plane of symmetry, only modes that are
mirrored too would be found.
"""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from gradedesign.common.values.locate import Where
from gradedesign.common.values.suggest import shown
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeLimit(Limit, ABC):
    """The value of one mode of the part in one load case, which must not be below the limit."""

    number: int = 1  #: Of the mode, counted from the lowest, 1.

    #: Its value is the factor of the loads at which the part buckles, else a natural frequency.
    buckling: ClassVar[bool] = False
    converges: ClassVar[bool] = True
    unfavourable: ClassVar[str] = "low"
    # Of lattice far from the supports, or softer places that lead loads away from what buckles, the
    # value may be above that of the solid part.
    solid_is_best: ClassVar[bool] = False

    def mode(self) -> ModeGoal:
        """The value that analyses are to find."""
        return _goal(type(self), self.key.load_case, self.number)

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The value; none where an analysis finds none."""
        found = analysis.mode_values.get(self.key)
        return () if found is None else (self.row(found, judged_by),)


def _goal(limit: type[ModeLimit], load_case: str, number: int) -> ModeGoal:
    return ModeGoal(load_case=load_case, number=number, buckling=limit.buckling)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeKind:
    """How limits on modes are made of entries with the key ``least``: one per load case."""

    name: str  #: Of the kind, and of its list in ``[limits]``.
    made: type[ModeLimit]  #: Type of its limits.
    entry: Any  #: Layout of one table of its list, a type of `LimitEntry`.
    #: Name, component of its key and number of the mode that an entry limits.
    named: Callable[[Any], tuple[str, str, int]]
    #: Those of the load cases that an entry means which are judged.
    cases: Callable[[Sequence[LoadCaseSpec]], Sequence[LoadCaseSpec]]
    unseen: str  #: Modes that the half of a part does not have.

    def kind(self) -> LimitKind:
        """As it is registered."""
        return LimitKind(
            name=self.name,
            make=self._make,
            stated=self._stated,
            entry=self.entry,
            require=self._require,
        )

    def _each(
        self, limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec]
    ) -> list[tuple[Any, str, LoadCaseSpec]]:
        """Entries with the key of their value and each load case that they judge."""
        return [
            (entry, f"limits.{self.name}[{number}].least", load)
            for number, entry in enumerate(getattr(limits, self.name))
            for load in self.cases(entry.judged(load_cases))
        ]

    def _make(self, limits: LimitsSpec, placed: PlacedModel) -> tuple[list[Limit], list[str]]:
        made: list[Limit] = []
        for entry, case_key, load in self._each(limits, placed.load_cases):
            name, component, number = self.named(entry)
            made.append(
                self.made(
                    key=LimitKey(kind=self.name, component=component, load_case=load.name),
                    name=name,
                    allowed=entry.least,
                    case_key=case_key,
                    number=number,
                )
            )
        return made, []

    def _stated(
        self, limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], _material: Material
    ) -> list[StatedLimit]:
        stated = []
        for entry, _, load in self._each(limits, load_cases):
            name, _, number = self.named(entry)
            allowed = f"at least {entry.least:g} {self.made.unit}"
            room = _goal(self.made, load.name, number).room
            stated.append(StatedLimit(name=name, load_case=load.name, allowed=allowed, modes=room))
        return stated

    def _require(
        self,
        limits: LimitsSpec,
        load_cases: Sequence[LoadCaseSpec],
        _regions: Mapping[str, Region],
        where: Where,
    ) -> None:
        """Refuse modes of a part of which only a share is given: those of the whole are others."""
        for _, case_key, load in self._each(limits, load_cases):
            planes = [fix.region for fix in load.fix if fix.symmetry]
            if planes:
                raise CaseError(
                    f"{where(case_key)}: load case {shown(load.name)} mirrors the part at "
                    f"{shown(planes[0])}, so that {self.unseen}, would not be found; expected the "
                    f'whole part, or components = "..." instead of symmetry = true where the '
                    f"region is a real support"
                )
