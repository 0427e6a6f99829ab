"""Printed output of commands: data, texts, tables, limits and warnings of a result."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import typer

from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.commands.layout import say, table_lines, wrapped

#: Share of a size below which a value is rounding noise.
_NOISE = 1e-9


def print_json(data: Any) -> None:
    """Print plain data for another program."""
    typer.echo(json.dumps(data, indent=2, allow_nan=False, default=str))


def print_text(text: str, *, hang: int = 0) -> None:
    """Print a text within the width, its later lines indented by ``hang``."""
    say("\n".join(wrapped(text, hang=hang)))


def without_noise(values: Iterable[float], size: float) -> list[float]:
    """Values for display: 0 if they are rounding noise relative to a size."""
    return [0.0 if abs(value) < _NOISE * size else float(value) for value in values]


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table within the width, its columns aligned; bold title on a terminal."""
    bold = sys.stdout.isatty()
    for line in wrapped(title, hang=2):
        say(typer.style(line, bold=True) if bold else line)
    for line in table_lines(columns, rows):
        say(line)


def print_limits(rows: Sequence[LimitRow]) -> None:
    """Print a table of limits by their decisive values, and below it what judged them."""
    bases = list(dict.fromkeys(row.judged_by for row in rows))
    marks = {basis: f"[{n}]" for n, basis in enumerate(bases, start=1)}
    banded = any(row.band is not None for row in rows)
    print_table(
        f"Limits{', by the unfavourable ends of their bands' if banded else ''}",
        ("limit", "load case", "value", "allowed", "used", "", "band", "by"),
        [
            (
                row.name,
                row.load_case,
                f"{row.decisive:.4g} {row.unit}",
                f"{row.limit:.4g} {row.unit}" + (f" ({row.stated})" if row.stated else ""),
                f"{row.utilisation:.1%}",
                row.word,
                row.band_words or "-",
                marks[row.judged_by],
            )
            for row in rows
        ],
    )
    for basis, mark in marks.items():
        print_text(f"  {mark} {basis}", hang=6)
    for row in rows:
        if row.bodies_words:
            print_text(f"  {row.name} ({row.load_case}): {row.bodies_words}", hang=6)


def print_as_built(result: RunResult) -> None:
    """Print the masses of the designed and the as-built body, and what varies between bodies."""
    built = result.measures.get("as_built", {})
    if built.get("nominal_g") is not None:
        nominal, grown = built["nominal_g"], built["as_built_g"]
        print_text(
            f"as built by {built['process']}: {grown:.4g} g, nominal {nominal:.4g} g "
            f"({grown / nominal - 1.0:+.1%})",
            hang=2,
        )
    for entry in built.get("variants", ()):
        print_text(
            f"  {entry['limit']} ({entry['load_case']}) over random bodies: mean "
            f"{entry['mean']:.4g}, 5 to 95 % {entry['low']:.4g} to {entry['high']:.4g} "
            f"{entry['unit']}, {entry['held']:.0%} hold",
            hang=6,
        )


def duration(seconds: float) -> str:
    """Seconds below two minutes, minutes below two hours, hours.

    Examples
    --------
    >>> duration(90), duration(3600), duration(9000)
    ('90 s', '60 min', '2.5 h')
    """
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def print_warnings(warnings: Iterable[str]) -> None:
    """Print warnings, one paragraph each."""
    for warning in warnings:
        print_text(f"warning: {warning}", hang=2)


def print_files(folder: object, names: Iterable[str]) -> None:
    """Print where files are, and their names."""
    print_text(f"files in {folder}: {', '.join(sorted(set(names)))}", hang=2)
