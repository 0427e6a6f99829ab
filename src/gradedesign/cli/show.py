"""Tables and progress lines: rich on a terminal, plain lines elsewhere."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gradedesign.ladder.verdict import LimitRow
from gradedesign.workspace.progress import Event

#: Sizing reports every iteration; only each n-th is worth a line.
SIZING_EVERY = 10


def print_json(data: Any) -> None:
    """Print plain data for another program."""
    typer.echo(json.dumps(data, indent=2, allow_nan=False, default=str))


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; without a terminal as aligned plain lines."""
    if sys.stdout.isatty():
        table = Table(title=title, title_justify="left")
        for column in columns:
            table.add_column(escape(column))
        for row in rows:
            table.add_row(*(escape(cell) for cell in row))
        Console().print(table)
        return
    typer.echo(title)
    widths = [max(len(str(line[k])) for line in [columns, *rows]) for k in range(len(columns))]
    for line in [columns, *rows]:
        cells = (str(v).ljust(w) for v, w in zip(line, widths, strict=True))
        typer.echo("  " + "  ".join(cells).rstrip())


def limit_columns(rows: Sequence[LimitRow]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and cells of a table of limits."""
    header = ("limit", "load case", "value", "allowed", "margin", "second mesh", "", "judged by")
    return header, [
        (
            row.name,
            row.load_case,
            f"{row.value:.4g} {row.unit}",
            f"{row.limit:.4g} {row.unit}" + (f" ({row.stated})" if row.stated else ""),
            f"{1 - row.use:+.1%}",
            "-" if row.resolution_error is None else f"{row.resolution_error:+.1%}",
            "holds" if row.passed else "BROKEN",
            row.judged_by,
        )
        for row in rows
    ]


class ProgressLines:
    """A listener that prints one line per stage and iteration."""

    def __init__(self) -> None:
        self._sizing = 0

    def __call__(self, event: Event) -> None:
        """Print an event, unless it is one of many sizing steps or a mere start."""
        if event.message == "started":
            self._sizing = 0
            return
        if event.stage == "sizing" and event.seconds is None:
            self._sizing += 1
            if self._sizing % SIZING_EVERY != 1:
                return
        took = "" if event.seconds is None else f" ({event.seconds:.1f} s)"
        typer.echo(f"{event.stage:<11} {event.message}{took}")
        sys.stdout.flush()
