"""Buckling of the part: the factor of its loads at which it buckles must stay above a limit.

Linear buckling of the whole design under a load case: stress grows with the loads, with
temperature changes and prescribed displacements too, until it takes all stiffness off some shape.
The lowest factors enter sizing as one smooth value: where two meet, as those of a square column do,
the lower of them has no derivative.

References
----------
F. Ferrari, O. Sigmund (2019), Revisiting topology optimization with buckling constraints, Struct.
Multidisc. Optim. 59, 1401-1415.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.value_types import Number
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitEntry, LimitsSpec
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
from gradedesign.mechanics.material.material import Material

#: Exponent of the norm over reciprocal factors that stands for the greatest of them: two equal ones
#: count as 0.4 % more than one, five as 1.0 %. As Ferrari and Sigmund take it.
_NORM = 160.0


class PartBucklingEntry(LimitEntry):
    """Least factor of the loads of a load case at which the part buckles."""

    called: ClassVar[Mapping[str, str]] = {
        "min": "least",
        "minimum": "least",
        "value": "least",
        "limit": "least",
        "factor": "least",
        "load_factor": "least",
    }

    least: Annotated[float, Number(at_least=1.0, at_most=1e6)] = Field(examples=[2.0])
    """Least allowed factor of the loads."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartBucklingLimit(Limit):
    """The lowest factor of the loads of one load case at which the part buckles."""

    unit: ClassVar[str] = "times the loads"
    converges: ClassVar[bool] = True
    unfavourable: ClassVar[str] = "low"
    # Softer places elsewhere may lead loads away from what buckles.
    solid_is_best: ClassVar[bool] = False

    @property
    def measure(self) -> str:
        """Linear."""
        return "linear buckling, lowest factor of all loads of the load case"

    def mode(self) -> ModeGoal:
        """The factor that analyses are to find."""
        return ModeGoal(load_case=self.key.load_case, number=1, buckling=True)

    def predict(self, state: HomogenisedState) -> Predicted:
        """Lowest factor of the homogenised part."""
        lowest = float(state.load_factors(self.key.load_case).values[0])
        return Predicted(value=self.factor * lowest, load_case=self.key.load_case)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """A smooth value a little below the lowest factor, with its derivatives."""
        load_case = self.key.load_case
        modes = state.load_factors(load_case)
        value, by_factor = smooth_lowest(modes.values)
        by_displacement, by_design = state.through_load_factors(load_case, self.factor * by_factor)
        response = Response(
            name=self.name,
            load_case=load_case,
            value=self.factor * value,
            by_displacement=by_displacement,
            by_design=by_design,
            shape=modes.shapes[0].reshape(-1, 3).T,
        )
        return (response,)

    def compliance(self, value: float) -> float:
        """One over the factor, which grows as stiffness does."""
        return 1.0 / value

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The lowest factor; none where an analysis finds none."""
        found = analysis.mode_values.get(self.key)
        return () if found is None else (self.row(found, judged_by),)


def smooth_lowest(factors: FloatArray) -> tuple[float, FloatArray]:
    """A smooth value just below the lowest of factors ``(k,)``, and its derivatives by them.

    Examples
    --------
    >>> import numpy as np
    >>> smooth_lowest(np.array([2.0, 4.0]))[0]
    2.0
    """
    lowest = float(factors.min())
    value = lowest * float(((lowest / factors) ** _NORM).sum()) ** (-1.0 / _NORM)
    return value, (value / factors) ** (_NORM + 1.0)


def _cases(entry: PartBucklingEntry, load_cases: Sequence[LoadCaseSpec]) -> list[LoadCaseSpec]:
    return [load for load in load_cases if entry.load_case in (None, load.name)]


def _entries(limits: LimitsSpec) -> Sequence[PartBucklingEntry]:
    return getattr(limits, KIND.name)


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[list[Limit], list[str]]:
    made: list[Limit] = [
        PartBucklingLimit(
            key=LimitKey(kind=KIND.name, load_case=load.name),
            name="buckling of the part",
            allowed=entry.least,
            case_key=f"limits.{KIND.name}[{number}].least",
        )
        for number, entry in enumerate(_entries(limits))
        for load in _cases(entry, placed.load_cases)
    ]
    return made, []


def _stated(
    limits: LimitsSpec, load_cases: Sequence[LoadCaseSpec], _material: Material
) -> list[StatedLimit]:
    return [
        StatedLimit(
            name="buckling of the part",
            load_case=load.name,
            allowed=f"at least {entry.least:g} times the loads",
            modes=ModeGoal(load_case=load.name, number=1, buckling=True).room,
        )
        for entry in _entries(limits)
        for load in _cases(entry, load_cases)
    ]


def _require(
    limits: LimitsSpec,
    load_cases: Sequence[LoadCaseSpec],
    _regions: Mapping[str, Region],
    where: Where,
) -> None:
    """Refuse factors of a part of which only a share is given: other shapes may buckle first."""
    for number, entry in enumerate(_entries(limits)):
        key = f"limits.{KIND.name}[{number}].least"
        for load in _cases(entry, load_cases):
            planes = [fix.region for fix in load.fix if fix.symmetry]
            if planes:
                raise CaseError(
                    f"{where(key)}: load case {shown(load.name)} mirrors the part at "
                    f"{shown(planes[0])}, so that shapes which are not mirrored, often the first "
                    f'to buckle, would not be found; expected the whole part, or components = "..."'
                    f" instead of symmetry = true where the region is a real support"
                )


#: Buckling of the part, ``part_buckling = [{least = 2.0}]``.
KIND = LimitKind(
    name="part_buckling", make=_make, stated=_stated, entry=PartBucklingEntry, require=_require
)
