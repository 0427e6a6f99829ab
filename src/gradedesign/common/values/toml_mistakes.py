"""Usual mistakes in the text of a TOML file: which one it is, and how the line should read."""

from __future__ import annotations

import re
from collections.abc import Sequence

_CURLY = str.maketrans(
    {
        **dict.fromkeys("\u201c\u201d\u201e\u201f\u2033", '"'),
        **dict.fromkeys("\u2018\u2019\u201a\u2032", "'"),
    }
)
_KEY = r"""(?:[A-Za-z0-9_-]+|"[^"]*")(?:\.[A-Za-z0-9_-]+)*"""
_ENTRY = re.compile(rf"\s*({_KEY})\s*=\s*(.*)", re.DOTALL)
_HEADER = re.compile(r"\s*\[{1,2}([^\[\]]+)\]")
#: A value that needs quotes: a number with a unit behind it, or a word that is no truth.
_BARE = re.compile(
    r"[+-]?[0-9.]+\s*[A-Za-z%\u00b5\u00b0][^,#\[\]{}\"]*"
    r"|(?!true|false|inf|nan)[A-Za-z][^,#=\[\]{}\"]*"
)
_QUOTES = "\"'"
#: Rows of a list, at most: one that a person typed. Chosen, not measured.
_MOST_ROWS = 60
#: Longest line that is looked at, characters: one that a person typed. Chosen, not measured.
_LONGEST = 400


def mistake(message: str, rows: Sequence[str], row: int) -> str:
    """Probable mistake in a row, counted from 0, and how it should read; empty where unknown.

    ``message``: of the parser. ``rows``: lines of the file.
    """
    line = rows[row]
    if len(line) > _LONGEST:
        return ""
    if line.lstrip().startswith("//"):
        return "a remark begins with #"
    if "overwrite" in message or "twice" in message or "mutate" in message:
        return _twice(rows, row)
    if line.translate(_CURLY) != line:
        return f"these quotes are none of a keyboard; write {line.translate(_CURLY).strip()}"
    body = re.split(r"(?:^|\s+)#", line)[0]
    if assigned := re.search(rf"(?:^|[{{,])\s*({_KEY})\s*:?\s+(?=[\"'0-9\[{{])", body):
        return f"a value follows a key after =; write {assigned[1]} = ..."
    entry = _ENTRY.fullmatch(body.rstrip())
    if entry is None:
        return ""
    key, value = entry[1], entry[2].strip()
    if value.endswith(";"):
        return f"no ; ends a line; write {key} = {value.rstrip(';').rstrip()}"
    if "\\" in value and ("Unescaped" in message or "escape" in message):
        return f"a backslash stands in single quotes; write {key} = '{value.strip(_QUOTES)}'"
    if value.lower() in ("true", "false"):
        return f"write {key} = {value.lower()}"
    if len(value) > 1 and {value[0], value[-1]} == set(_QUOTES):
        return f'the two quotes differ; write {key} = "{value[1:-1]}"'
    if value.count('"') % 2 == 1:
        closed = f'"{value}' if not value.startswith('"') and value.endswith('"') else f'{value}"'
        if value[:1] in ("[", "{"):
            return f"a text in {key} lacks one of its quotes"
        return f"the text lacks one of its quotes; write {key} = {closed}"
    if not value:
        return f"{key} has no value"
    if _BARE.fullmatch(value):
        return f'texts and values with a unit stand in quotes; write {key} = "{value.strip()}"'
    parts = [part.strip() for part in value.split(",")]
    if len(parts) > 1 and all(_BARE.fullmatch(part) for part in parts):
        listed = ", ".join(f'"{part}"' for part in parts)
        return f"a list stands in brackets, values with a unit in quotes; write {key} = [{listed}]"
    if value[:1] in ("[", "{"):
        if bare := _bare_entry(value):
            return f'texts and values with a unit stand in quotes; write "{bare}"'
        if apart := re.search(r"([\w.\"]+)\s+([\w.\"]+)", re.sub(r'"[^"]*"', '""', value)):
            return f"entries stand apart by commas; write {apart[1]}, {apart[2]}"
        if any(value.count(a) != value.count(b) for a, b in ("[]", "{}")):
            return f"the brackets of {key} do not match: as many ] as [ and as many }} as {{"
    return ""


def unclosed(rows: Sequence[str], row: int) -> int:
    """The row of a list, table or text that is left open before this one; the same without one.

    A parser reads on to the end of the file, or to a row that cannot go on with it.
    """
    last = min(row, len(rows))
    for start in range(last - 1, max(last - _MOST_ROWS, 0) - 1, -1):
        entry = _ENTRY.fullmatch(rows[start])
        if entry is None:
            if _HEADER.fullmatch(rows[start].rstrip()):
                return row
            continue
        outside = re.sub(r'"[^"\n]*"', '""', "\n".join([entry[2], *rows[start + 1 : row]]))
        opened = any(outside.count(a) > outside.count(b) for a, b in ("[]", "{}"))
        if opened or outside.split("\n")[0].count("'") % 2 == 1:
            return start
    return row


def _bare_entry(value: str) -> str:
    """The first entry of a list or inline table that needs quotes; empty without one."""
    outside = re.sub(r'"[^"]*"', '""', value)
    for part in re.split(r"[,\[\]{}]", outside):
        entry = part.partition("=")[2] if "=" in part else part
        if _BARE.fullmatch(entry.strip()):
            return entry.strip()
    return ""


def _twice(rows: Sequence[str], row: int) -> str:
    """Say where a key or table that is repeated first occurs."""
    header = _HEADER.match(rows[row])
    if header is not None:
        for n, line in enumerate(rows[:row]):
            before = _HEADER.match(line)
            if before is not None and before[1].strip() == header[1].strip():
                return (
                    f"[{header[1].strip()}] stands here again, first in line {n + 1}; put their "
                    f"keys together"
                )
        return ""
    entry = _ENTRY.fullmatch(rows[row])
    if entry is None:
        return ""
    for n in range(row - 1, -1, -1):
        if _HEADER.match(rows[n]) and "=" not in rows[n]:
            break
        before = _ENTRY.fullmatch(rows[n])
        if before is not None and before[1] == entry[1]:
            return f"{entry[1]} stands here again, first in line {n + 1}; leave one out"
    return "a key stands twice in this line; leave one out"
