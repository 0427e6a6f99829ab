"""An expected quantity of a case beside the value of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """An expected quantity of a case and the value of this run.

    ``from_run``: the expected value is one that this program gave before, no reference.
    """

    case: str
    quantity: str
    value: Any
    expected: Any
    tolerance: str
    origin: str
    from_run: bool
    passed: bool


def short(value: Any) -> str:
    """A value for people to read."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
