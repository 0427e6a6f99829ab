"""Natural frequency: the lowest, or one by its number, must stay above a limit.

Small free vibrations of the part about the supports of a load case, undamped and without prestress:
stiffness and mass are those of the design. Modes are numbered by their frequencies, and the n-th
frequency is what is limited, whatever shape it has: no mode is followed from one design to the
next. Frequencies just above the n-th enter sizing beside it: where modes meet, as the two bending
modes of a square beam do, each would else be raised at the cost of the other, for ever.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from gradedesign.common.values.locate import Where
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.value_types import Whole
from gradedesign.errors import CaseError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.fe.modes import ModeGoal
from gradedesign.mechanics.limits.analysis import Analysis
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
from gradedesign.mechanics.limits.limits_schema import AtLeast, LimitEntry, LimitsSpec
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.state import HomogenisedState, ModeShape, Predicted, Response
from gradedesign.mechanics.material.material import Material

#: Frequencies up to this share above the n-th enter sizing beside it: one step moves a frequency by
#: less, a few per cent. Chosen, not measured.
_NEAR = 0.15
#: Greatest number of a mode: an analysis finds all below it too, each in memory of its own.
_MOST = 12


class FrequencyEntry(LimitEntry):
    """Least natural frequency of the part, held as in a load case; without one, as in each."""

    called: ClassVar[Mapping[str, str]] = {
        "min": "least",
        "minimum": "least",
        "value": "least",
        "limit": "least",
        "number": "mode",
    }

    least: Annotated[float, AtLeast("frequency")] = Field(examples=["400 Hz"])
    """Least allowed frequency, Hz."""
    mode: Annotated[int, Whole(at_least=1, at_most=_MOST)] = Field(default=1, examples=[1])
    """Number of the mode, counted from the lowest frequency."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrequencyLimit(Limit):
    """The n-th lowest natural frequency about the supports of one load case."""

    number: int  #: n, counted from 1.

    unit: ClassVar[str] = "Hz"
    converges: ClassVar[bool] = True
    unfavourable: ClassVar[str] = "low"
    # Lattice far from the supports may raise a frequency above that of the solid part.
    solid_is_best: ClassVar[bool] = False

    @property
    def measure(self) -> str:
        """Undamped."""
        return "undamped natural frequency, without prestress"

    def mode(self) -> ModeGoal:
        """The frequency that analyses are to find."""
        return ModeGoal(load_case=self.key.load_case, number=self.number)

    def predict(self, state: HomogenisedState) -> Predicted:
        """Frequency of the homogenised part, Hz."""
        frequencies = state.modes(self.key.load_case).frequencies
        value = self.factor * float(frequencies[self.number - 1])
        return Predicted(value=value, load_case=self.key.load_case)

    def responses(self, state: HomogenisedState) -> tuple[Response, ...]:
        """The n-th frequency, and those just above it, with their derivatives."""
        modes = state.modes(self.key.load_case)
        frequencies = modes.frequencies
        first = self.number - 1
        near = frequencies[first:] <= (1.0 + _NEAR) * frequencies[first]
        return tuple(
            Response(
                name=f"{self.name}, mode {k + 1}",
                load_case=self.key.load_case,
                value=self.factor * float(frequencies[k]),
                mode=ModeShape(
                    shape=modes.shapes[k].reshape(-1, 3).T,
                    square=float(modes.values[k]),
                    by_square=self.factor * float(frequencies[k] / modes.values[k] / 2.0),
                ),
            )
            for k in first + np.flatnonzero(near)
        )

    def compliance(self, value: float) -> float:
        """One over the square of the frequency."""
        return value**-2

    def rows(self, analysis: Analysis, judged_by: str) -> tuple[LimitRow, ...]:
        """The frequency, Hz; none where an analysis finds no frequencies."""
        found = analysis.mode_values.get(self.key)
        return () if found is None else (self.row(found, judged_by),)


def _number_words(number: int) -> str:
    """Name of the limit on a mode."""
    return "lowest natural frequency" if number == 1 else f"natural frequency {number}"


def _held_alike(load_case: LoadCaseSpec) -> tuple[object, ...]:
    """Regions and components that a load case holds: equal for those with the same modes."""
    held = ((f.region, tuple(d is not None for d in f.displacement)) for f in load_case.fix)
    return tuple(sorted(set(held)))


def _cases(entry: FrequencyEntry, load_cases: Sequence[LoadCaseSpec]) -> list[LoadCaseSpec]:
    """Load cases whose supports an entry judges: the first of those that hold the part alike."""
    of_entry = [load for load in load_cases if entry.load_case in (None, load.name)]
    first: dict[tuple[object, ...], LoadCaseSpec] = {}
    for load in of_entry:
        first.setdefault(_held_alike(load), load)
    return list(first.values())


def _entries(limits: LimitsSpec) -> Sequence[FrequencyEntry]:
    return getattr(limits, KIND.name)


def _make(limits: LimitsSpec, placed: PlacedModel) -> tuple[list[Limit], list[str]]:
    made: list[Limit] = [
        FrequencyLimit(
            key=LimitKey(kind=KIND.name, component=f"mode {entry.mode}", load_case=load.name),
            name=_number_words(entry.mode),
            allowed=entry.least,
            case_key=f"limits.{KIND.name}[{number}].least",
            number=entry.mode,
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
            name=_number_words(entry.mode),
            load_case=load.name,
            allowed=f"at least {entry.least:g} Hz",
            modes=entry.mode,
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
    """Refuse frequencies of a part of which only a share is given: other modes may be lower."""
    for number, entry in enumerate(_entries(limits)):
        for load in _cases(entry, load_cases):
            planes = [fix.region for fix in load.fix if fix.symmetry]
            if planes:
                raise CaseError(
                    f"{where(f'limits.{KIND.name}[{number}].least')}: load case "
                    f"{shown(load.name)} mirrors the part at {shown(planes[0])}, so that modes "
                    f"which are not mirrored, often the lowest, would not be found; expected the "
                    f'whole part, or components = "..." instead of symmetry = true where the '
                    f"region is a real support"
                )


#: Natural frequencies, ``frequency = [{least = "400 Hz"}]``.
KIND = LimitKind(
    name="frequency", make=_make, stated=_stated, entry=FrequencyEntry, require=_require
)
