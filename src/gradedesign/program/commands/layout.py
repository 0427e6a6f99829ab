"""Text and tables within the width of the terminal: words are wrapped, never cut."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap
from collections.abc import Sequence

#: Columns where there is no terminal, and COLUMNS does not say otherwise.
WIDTH = 80
#: Columns that are used at least, and at most: longer lines are hard to read. Chosen, not measured.
_NARROWEST, WIDEST = 40, 120
#: A number with its unit, between which no line ends.
_UNIT = re.compile(r"\d (?=(mm|N|MPa|GPa|g|s|%|GB)\b|%)")
_GLUE = "\u00a0"
#: Spaces before a table's lines and between its columns. Chosen, not measured.
_INDENT, GAP = 2, 2


def say(text: str, *, err: bool = False) -> None:
    """Print lines to where standard output, or error, leads now, past a live line if there is one.

    Not `typer.echo`, which goes round the stream that a live line puts in its place.
    """
    stream = sys.stderr if err else sys.stdout
    stream.write(f"{text}\n")
    stream.flush()


def width_now() -> int:
    """Number of columns of the terminal; 80 if there is none."""
    return min(max(shutil.get_terminal_size((WIDTH, 24)).columns, _NARROWEST), WIDEST)


def wrapped(text: str, *, width: int | None = None, hang: int = 0) -> list[str]:
    """Lines of a text, the later ones indented by ``hang``; a word longer than a line stays whole.

    Examples
    --------
    >>> wrapped("files: lattice.stl, report.html", width=22, hang=2)
    ['files: lattice.stl,', '  report.html']
    """
    lines = textwrap.wrap(
        _UNIT.sub(_glued, text),
        width_now() if width is None else width,
        subsequent_indent=" " * hang,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_GLUE, " ") for line in lines] or [""]


def _glued(match: re.Match[str]) -> str:
    return match[0].replace(" ", _GLUE)


def table_lines(
    columns: Sequence[str], rows: Sequence[Sequence[str]], *, width: int | None = None
) -> list[str]:
    """Lines of a table with aligned columns, cells wrapped between words where it is too wide.

    Columns of numbers stand right. Where not even the longest words fit beside each other, every
    row becomes a block of lines, one for each column.
    """
    room = (width_now() if width is None else width) - _INDENT
    cells = [[str(cell) for cell in row] for row in (columns, *rows)]
    widths = _fitted(cells, room - GAP * (len(columns) - 1))
    if widths is None:
        return _blocks(cells, room)
    right = [_is_numeric([row[k] for row in cells[1:]]) for k in range(len(columns))]
    lines = []
    for row in cells:
        parts = [wrapped(cell, width=w) for cell, w in zip(row, widths, strict=True)]
        for n in range(max(map(len, parts), default=0)):
            texts = [part[n] if n < len(part) else "" for part in parts]
            aligned = (
                text.rjust(w) if r else text.ljust(w)
                for text, w, r in zip(texts, widths, right, strict=True)
            )
            lines.append((" " * _INDENT + (" " * GAP).join(aligned)).rstrip())
    return lines


def _fitted(cells: Sequence[Sequence[str]], room: int) -> list[int] | None:
    """Widths of columns that fit into the room, the widest narrowed first; None if none do."""
    table = list(zip(*cells, strict=True))
    widths = [max(map(len, column)) for column in table]
    least = [
        max((len(w) for cell in column for w in _UNIT.sub(_glued, cell).split(" ")), default=0)
        for column in table
    ]
    if sum(least) > room:
        return None
    while sum(widths) > room:
        open_ones = [k for k in range(len(widths)) if widths[k] > least[k]]
        widths[max(open_ones, key=lambda k: widths[k])] -= 1
    return widths


def _blocks(cells: Sequence[Sequence[str]], room: int) -> list[str]:
    """Every row as lines of its own, each with the name of its column."""
    names = cells[0]
    label = max(map(len, names))
    lines: list[str] = []
    for row in cells[1:]:
        lines += [""] if lines else []
        for name, cell in zip(names, row, strict=True):
            hang = _INDENT + label + GAP
            text = " " * _INDENT + name.ljust(label + GAP) + cell
            lines += wrapped(text, width=_INDENT + room, hang=hang)
    return lines


def _is_numeric(column: Sequence[str]) -> bool:
    """Whether every cell of a column begins like a number or is a dash."""
    filled = [cell for cell in column if cell not in ("", "-")]
    return bool(filled) and all(_begins_a_number(cell) for cell in filled)


def _begins_a_number(cell: str) -> bool:
    word = cell.split()[0].rstrip("%") if cell.split() else ""
    try:
        float(word)
    except ValueError:
        return False
    return len(cell.split()) <= 2
