"""The record of an output: files about a finished run, beside those of its printed lattice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.formats.exporter import FieldSet
from gradedesign.program.outputs.analysed_model import AnalysedModel
from gradedesign.program.outputs.report_section import ReportSection


class WriteFile(Protocol):
    """Makes a file of the run folder, see `FinishedRun`."""

    def __call__(
        self, name: str, writer: Callable[[Path], object], *, key: str | None = None
    ) -> None:
        """Let ``writer`` make the file ``name``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FinishedRun:
    """A finished run, as an output receives it.

    Attributes
    ----------
    case_text : str
        The case file as it is.
    result : callable
        Without arguments: the `RunResult` with the names of all files so far.
    pictures : callable
        Without arguments: PNG bytes by the names of the pictures in the result's ``files``.
    fields : callable
        Without arguments: a `FieldSet` at a time, computed when it is taken.
    models : callable
        Without arguments: an `AnalysedModel` at a time, computed when it is taken.
    no_model : mapping of str to str
        Analyses that no `AnalysedModel` can hold, by name, and why.
    scene : callable
        Without arguments: data of the scene, see `program/pictures/page.py`; None without one.
    sections : sequence of ReportSection
        Of the report, by their names.
    write : callable
        ``write(name, writer, key=None)`` lets ``writer(path)`` make a new file, which then takes
        its place as ``name`` in the run folder; with a ``key`` the result's ``files`` list it.
    """

    case_text: str
    result: Callable[[], RunResult]
    write: WriteFile
    pictures: Callable[[], Mapping[str, bytes]] = dict
    fields: Callable[[], Iterator[FieldSet]] = lambda: iter(())
    models: Callable[[], Iterator[AnalysedModel]] = lambda: iter(())
    no_model: Mapping[str, str] = field(default_factory=dict)
    scene: Callable[[], Mapping[str, Any] | None] = lambda: None
    sections: Sequence[ReportSection] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """Writes files about a finished run.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[output] formats`` names, such as ``report``.
    write : callable
        ``write(run)`` writes files by ``run.write`` and returns warnings.
    last : bool
        Whether it shows the result with all other files, and so is written after them.
    """

    name: str
    write: Callable[[FinishedRun], Iterable[str]]
    last: bool = False
