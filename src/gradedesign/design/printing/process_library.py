"""Published measurements of printing processes, as plain data beside this file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from importlib import resources

from gradedesign.design.printing.process import Process
from gradedesign.design.printing.process_schema import MeasuredProcess


def builtin_processes() -> Iterator[Process]:
    """The processes of ``processes.toml``, whose keys are those of ``[process]`` in a case."""
    text = resources.files(__package__).joinpath("processes.toml").read_text("utf-8")
    for name, table in tomllib.loads(text).items():
        yield MeasuredProcess.model_validate(table).record(name)
