"""The record of a section: words and tables that stand folded in the report of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gradedesign.design.verdict.result import RunResult
from gradedesign.errors import PluginError


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportTable:
    """A table of a section.

    Attributes
    ----------
    header : tuple of str
        A name for each column.
    rows : tuple of tuple of str
        As many words in each as the header has.
    right : tuple of int
        Columns that align right, counted from 0: those of numbers.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Refuse rows of another length than the header."""
        for row in self.rows:
            if len(row) != len(self.header):
                raise PluginError(
                    f"a row of a report's table has {len(row)} cells, expected "
                    f"{len(self.header)}, as the header {self.header}: {row}"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportSection:
    """A section of the report, after what the verdict rests on, in the order of names.

    Attributes
    ----------
    name : str
        Lower case with dashes.
    title : str
        Its heading.
    content : callable
        ``content(result)`` returns paragraphs and tables, which the report escapes; nothing leaves
        the section out.
    """

    name: str
    title: str
    content: Callable[[RunResult], Iterable[str | ReportTable]]
