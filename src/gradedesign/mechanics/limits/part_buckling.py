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

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.arrays import FloatArray
from gradedesign.common.values.value_types import Number
from gradedesign.mechanics.limits.limits_schema import LimitEntry
from gradedesign.mechanics.limits.mode_limit import ModeKind, ModeLimit
from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response

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
class PartBucklingLimit(ModeLimit):
    """The lowest factor of the loads of one load case at which the part buckles."""

    unit: ClassVar[str] = "times the loads"
    buckling: ClassVar[bool] = True

    @property
    def measure(self) -> str:
        """Linear."""
        return "linear buckling, lowest factor of all loads of the load case"

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


#: Buckling of the part, ``part_buckling = [{least = 2.0}]``.
KIND = ModeKind(
    name="part_buckling",
    made=PartBucklingLimit,
    entry=PartBucklingEntry,
    named=lambda _entry: ("buckling of the part", "", 1),
    cases=lambda load_cases: load_cases,
    unseen="shapes which are not mirrored, often the first to buckle",
).kind()
