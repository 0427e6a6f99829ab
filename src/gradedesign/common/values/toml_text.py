"""Plain data as a TOML text: what `tomllib` reads, written."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(data: Mapping[str, Any]) -> str:
    """A TOML file with a header for every table of the first level, and inline tables below.

    ``data``: tables, lists, texts, numbers and truths, as ``tomllib.loads`` gives them.

    Examples
    --------
    >>> print(toml_text({"a": {"b": 1.5}, "c": [{"d": {"e": "x"}}]}), end="")
    [a]
    b = 1.5
    <BLANKLINE>
    [[c]]
    d = {e = "x"}
    """
    plain = {key: value for key, value in data.items() if not _tables(value)}
    blocks = ["".join(_lines(plain))] if plain else []
    for key, value in data.items():
        name = _key(key)
        if isinstance(value, dict):
            blocks.append(f"[{name}]\n{''.join(_lines(value))}")
        elif _tables(value):
            blocks += [f"[[{name}]]\n{''.join(_lines(entry))}" for entry in value]
    return "\n".join(blocks)


def _tables(value: Any) -> bool:
    """Whether a value is a table, or a list of nothing but tables."""
    is_list = isinstance(value, list) and len(value) > 0
    return isinstance(value, dict) or (is_list and all(isinstance(v, dict) for v in value))


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {toml_value(value)}\n" for key, value in table.items()]


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    # JSON escapes what TOML wants escaped, but for DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_value(value: Any) -> str:
    """A value of plain data in TOML, on one line."""
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        inside = ", ".join(f"{_key(k)} = {toml_value(v)}" for k, v in value.items())
        return f"{{{inside}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml_value, value))}]"
    return str(value)  # numbers, dates and times: as TOML has them
