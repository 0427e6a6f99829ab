"""Checks of the parameters that a case may set."""

from __future__ import annotations

import math

from gradedesign import CaseError

#: Most repeats of a structure in a cell along an axis; more are smaller cells by another name.
_MOST_REPEATS = 8


def repeats(name: str, value: float) -> int:
    """Whole number of repeats in a cell: anything else would have no period of one cell.

    Raises
    ------
    CaseError
        If the value is not a whole number from 1 to `_MOST_REPEATS`.
    """
    if not (value == round(value) and 1 <= value <= _MOST_REPEATS):
        raise CaseError(
            f"{name} is {value:g}, expected a whole number, 1 to {_MOST_REPEATS}, so that the cell "
            f"repeats after its own length; for finer structures use smaller cells"
        )
    return int(value)


def within(name: str, value: float, low: float, high: float, meaning: str) -> float:
    """Pass on a value in its range.

    Raises
    ------
    CaseError
        Naming the parameter, its range and its meaning.
    """
    if not (math.isfinite(value) and low <= value <= high):
        raise CaseError(f"{name} is {value:g}, expected {low:g} to {high:g}: {meaning}")
    return float(value)
