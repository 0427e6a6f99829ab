"""Pieces of HTML that the report is made of; every text is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any


def plain(value: Any) -> str:
    """Write a value of result.json for a person."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {plain(v)}" for k, v in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " to ".join(plain(v) for v in value)
    return str(value)


def percent(value: float | None) -> str:
    """Write a share with its sign, or a dash."""
    return "–" if value is None else f"{value:+.1%}"


def table(
    header: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: set[int] | None = None
) -> str:
    """Lay out a table; columns in ``numbers`` align right, BROKEN and NO stand out."""
    aligned = numbers or set()

    def cell(tag: str, k: int, text: str) -> str:
        kind = ' class="n"' if k in aligned else ""
        broken = f'<span class="broken">{escape(text)}</span>' if text in ("BROKEN", "NO") else None
        return f"<{tag}{kind}>{broken or escape(text)}</{tag}>"

    head = "".join(cell("th", k, text) for k, text in enumerate(header))
    body = "".join(
        "<tr>" + "".join(cell("td", k, text) for k, text in enumerate(row)) + "</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
