"""What a run reports while it works; only the command line draws it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One step of a run.

    Attributes
    ----------
    stage : str
        Lower case with dashes: ``law``, ``walls``, ``solid``, ``sizing``, ``lattice``,
        ``explicit``, ``acceptance``.
    message : str
        One line for a person.
    seconds : float or None
        What the step took; None while it runs.
    values : mapping of str to float
        Numbers behind the message; each name ends in its unit (``mass_g``) or is a ratio.
    """

    stage: str
    message: str
    seconds: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))


#: Receives every event of a run, in the thread of the run; what it raises ends the run.
Listener: TypeAlias = Callable[[Event], None]


def ignore(event: Event) -> None:
    """Listen to nothing: the default of ``run(..., on_event=...)``."""
