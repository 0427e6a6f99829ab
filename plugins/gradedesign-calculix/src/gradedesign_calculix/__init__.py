"""CalculiX decks of what a run analysed, for gradedesign."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import Output, hookimpl
from gradedesign_calculix.calculix import write_decks

__all__ = ["gradedesign_outputs"]


@hookimpl
def gradedesign_outputs() -> Iterator[Output]:
    """Register the output ``inp``."""
    yield Output(name="inp", write=write_decks)
