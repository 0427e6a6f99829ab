"""Limits of a case that contradict each other, or that say nothing of a part."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from gradedesign.common.values.locate import Where
from gradedesign.common.values.problems import Problem, dotted
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.toml_lines import Key
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.errors import CaseError
from gradedesign.mechanics.limits.limits_schema import Allowed, LimitEntry, LimitsSpec, stated_words

#: Displacements below this, mm, are what machines of measurement are held to, not printed parts:
#: a micrometre stated where a millimetre was meant.
_LEAST_DISPLACEMENT = 1e-3


def repeated_limits(limits: LimitsSpec, load_cases: Sequence[str]) -> Iterator[Problem]:
    """Find limits of the same quantity in the same load case.

    Two of them contradict each other or one is void: which one is meant, only the user knows.

    ``load_cases``: names of all of them.
    """
    for name in limits.lists():
        seen: dict[tuple[Any, ...], tuple[int, LimitEntry]] = {}
        for number, entry in enumerate(getattr(limits, name)):
            what = _quantity(entry)
            for load_case in load_cases if entry.load_case is None else (entry.load_case,):
                if (first := seen.setdefault((*what, load_case), (number, entry)))[0] == number:
                    continue
                before = ("limits", name, first[0])
                yield Problem(
                    key=("limits", name, number),
                    message=f"found {_allowed_words(entry)} in load case {shown(load_case)}, where "
                    f"{dotted(before)} allows {_allowed_words(first[1])} of the same quantity; "
                    f"expected one limit for each load case: leave one out, or state load_case in "
                    f"both",
                )
                break


def require_displacements_fit(limits: LimitsSpec, where: Where, longest: float) -> None:
    """Refuse limits that allow displacements larger than the part, ``longest`` mm long.

    A linear analysis is one of displacements far smaller than the part, so that such a limit either
    limits nothing or was stated in another unit. Raises `CaseError` naming file, line and the
    value.
    """
    for key, allowed in _stated_displacements(limits):
        if allowed > longest:
            raise CaseError(
                f"{where(dotted(key))}: found {allowed:g} mm in a part that is {longest:.4g} "
                f"mm long; expected a displacement far smaller than the part, which is all that a "
                f"linear analysis describes; is its unit right?"
            )


def _stated_displacements(limits: LimitsSpec) -> Iterator[tuple[Key, float]]:
    """Every limit that is a length, with its key and its allowed value in mm.

    Multiples of the solid part's are left out.
    """
    for name in limits.lists():
        for number, entry in enumerate(getattr(limits, name)):
            for key, allowed in _allowed(entry).items():
                value = getattr(entry, key)
                if allowed.dimension == "length" and isinstance(value, float):
                    yield ("limits", name, number, key), value


def displacement_warnings(limits: LimitsSpec) -> Iterator[Problem]:
    """Warnings about displacements that no printed part is held to."""
    for key, value in _stated_displacements(limits):
        if value < _LEAST_DISPLACEMENT:
            yield Problem(
                key=key,
                message=f"allows {DIMENSIONS['length'].words(value)}, less than a micrometre, "
                f"which a lattice hardly ever holds; is its unit right?",
            )


def _quantity(entry: LimitEntry) -> tuple[Any, ...]:
    """Fields that identify the limited quantity: all but value and load case."""
    apart = {"load_case", *entry.allowing, *_allowed(entry)}
    return tuple(getattr(entry, name) for name in type(entry).model_fields if name not in apart)


def _allowed(entry: LimitEntry) -> dict[str, Allowed]:
    """Fields of a limit that hold its allowed value, with the function that reads each."""
    return {
        name: reader
        for name, field in type(entry).model_fields.items()
        for reader in field.metadata
        if isinstance(reader, Allowed)
    }


def _allowed_words(entry: LimitEntry) -> str:
    """The allowed value as a person reads it."""
    return entry.words or ", ".join(
        stated_words(getattr(entry, name), DIMENSIONS[reader.dimension].unit)
        for name, reader in _allowed(entry).items()
    )
