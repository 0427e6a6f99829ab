"""Natural frequency: the lowest, or one by its number, must stay above a limit.

Small free vibrations of the part about the supports of a load case, undamped and without prestress:
stiffness and mass are those of the design. Modes are numbered by their frequencies, and the n-th
frequency is what is limited, whatever shape it has: no mode is followed from one design to the
next. Frequencies just above the n-th enter sizing beside it: where modes meet, as the two bending
modes of a square beam do, each would else be raised at the cost of the other, for ever.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from gradedesign.common.values.value_types import Whole
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.limits_schema import AtLeast, LimitEntry
from gradedesign.mechanics.limits.mode_limit import ModeKind, ModeLimit
from gradedesign.mechanics.limits.state import HomogenisedState, ModeShape, Predicted, Response

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
class FrequencyLimit(ModeLimit):
    """The n-th lowest natural frequency about the supports of one load case."""

    unit: ClassVar[str] = "Hz"

    @property
    def measure(self) -> str:
        """Undamped."""
        return "undamped natural frequency, without prestress"

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


def _named(entry: FrequencyEntry) -> tuple[str, str, int]:
    number = entry.mode
    name = "lowest natural frequency" if number == 1 else f"natural frequency {number}"
    return name, f"mode {number}", number


def _held_alike(load_case: LoadCaseSpec) -> tuple[object, ...]:
    """Regions and components that a load case holds: equal for those with the same modes."""
    held = ((f.region, tuple(d is not None for d in f.displacement)) for f in load_case.fix)
    return tuple(sorted(set(held)))


def _held_apart(load_cases: Sequence[LoadCaseSpec]) -> list[LoadCaseSpec]:
    """The first of the load cases that hold the part alike."""
    first: dict[Hashable, LoadCaseSpec] = {}
    for load in load_cases:
        first.setdefault(_held_alike(load), load)
    return list(first.values())


#: Natural frequencies, ``frequency = [{least = "400 Hz"}]``.
KIND = ModeKind(
    name="frequency",
    made=FrequencyLimit,
    entry=FrequencyEntry,
    named=_named,
    cases=_held_apart,
    unseen="modes which are not mirrored, often the lowest",
).kind()
