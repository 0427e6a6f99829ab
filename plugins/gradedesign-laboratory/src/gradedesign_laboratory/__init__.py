"""Laboratory of cells for gradedesign: their effective properties, finite blocks, tables, plots."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import Command, hookimpl
from gradedesign_laboratory.command import homogenise, tabulate

__all__ = ["gradedesign_commands"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``gradedesign homogenise`` and ``gradedesign tabulate``."""
    yield Command(name="homogenise", call=homogenise)
    yield Command(name="tabulate", call=tabulate)
