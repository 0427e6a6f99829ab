"""Sweeps for gradedesign: many designs of one case, into one table and one plot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gradedesign import Command, hookimpl
from gradedesign_sweep.command import sweep

__all__ = ["gradedesign_commands"]


@hookimpl
def gradedesign_commands() -> Iterator[Command]:
    """Register ``gradedesign sweep``."""
    yield Command(name="sweep", call=sweep, layout=_study, resumable="go on with the same command")


def _study() -> Any:
    from gradedesign_sweep.study_schema import StudyFile

    return StudyFile
