"""Suites of cases for gradedesign: they run, and their results are held to expected values."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import Command, hookimpl
from gradedesign_validate.command import validate

__all__ = ["gradedesign_commands"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``gradedesign validate``."""
    yield Command(name="validate", call=validate)
