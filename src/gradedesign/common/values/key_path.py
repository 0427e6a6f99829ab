"""Dotted keys of a case file, such as ``load_case[0].load[1].force``, and values put at them."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from typing import Any

from gradedesign.common.values.problems import dotted
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.toml_lines import Key
from gradedesign.errors import CaseError

_PART = re.compile(r"([A-Za-z0-9_-]+)((?:\[\d{1,4}\])*)")


def parse_key(text: str) -> Key:
    """Parts of a dotted key; `gradedesign.common.values.problems.dotted` writes it.

    Raises `CaseError` if the text is no such key.

    Examples
    --------
    >>> parse_key("load_case[0].load[1].force")
    ('load_case', 0, 'load', 1, 'force')
    """
    key: list[str | int] = []
    for part in text.split("."):
        match = _PART.fullmatch(part)
        if match is None:
            raise CaseError(
                f"{shown(text)} is no key of a case; expected names with dots between them and "
                f'numbers of entries in brackets, such as "lattice.size" or '
                f'"load_case[0].load[0].force"'
            )
        key += [match[1], *(int(number) for number in re.findall(r"\d+", match[2]))]
    return tuple(key)


def with_values(data: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of a case file's content with other values at some keys.

    Raises `CaseError` if a key leads through a value that is no table, or to an entry that a list
    has not.

    ``data``: as TOML gives it; tables that a key leads through are added where they are missing.
    ``values``: by dotted key.

    Examples
    --------
    >>> with_values({"part": {"file": "a.stl"}}, {"part.file": "b.stl", "run.time": "9 min"})
    {'part': {'file': 'b.stl'}, 'run': {'time': '9 min'}}
    """
    content: dict[str, Any] = copy.deepcopy(dict(data))
    for text, value in values.items():
        key = parse_key(text)
        place: Any = content
        for depth, part in enumerate(key[:-1]):
            _require_entry(place, key, depth)
            if isinstance(place, dict):
                place.setdefault(part, {})
            place = place[part]
        _require_entry(place, key, len(key) - 1)
        place[key[-1]] = copy.deepcopy(value)
    return content


def _require_entry(place: Any, key: Key, depth: int) -> None:
    """Raise unless the path of a key leads through existing tables and list entries."""
    part, so_far = key[depth], dotted(key[:depth])
    if isinstance(part, int):
        if not isinstance(place, list):
            raise CaseError(f"{dotted(key)}: {so_far} is {shown(place)}; expected a list")
        if part >= len(place):
            raise CaseError(
                f"{dotted(key)}: {so_far} has {len(place)} entries, counted from [0]; expected "
                f"one of them"
            )
    elif not isinstance(place, dict):
        hint = f"; name its entry, {so_far}[0]" if isinstance(place, list) else ""
        raise CaseError(f"{dotted(key)}: {so_far} is {shown(place)}; expected a table{hint}")
