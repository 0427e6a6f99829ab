"""Designs side by side for gradedesign: sweeps of a case, and finished runs compared."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gradedesign import Command, hookimpl
from gradedesign_sweep.command import compare, sweep

__all__ = ["gradedesign_commands"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``gradedesign sweep`` and ``gradedesign compare``."""
    yield Command(name="sweep", call=sweep, layout=_study, resumable="go on with the same command")
    yield Command(name="compare", call=compare)


def _study() -> Any:
    from gradedesign_sweep.study_schema import StudyFile

    return StudyFile
