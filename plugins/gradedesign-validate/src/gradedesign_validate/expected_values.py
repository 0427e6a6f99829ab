"""Expected quantities of a case (``expected.toml``) beside the values of a run."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradedesign import CaseError
from gradedesign.commands import say, write_text

#: ``["iterations.-1.limits.0.discrepancy"]`` or ``[status]``, and ``value = 1.5  # comment``.
_HEADER = re.compile(r'\s*\[(?:"([^"]+)"|([^"\]]+))\]')
_VALUE = re.compile(r'(\s*value\s*=\s*)("[^"]*"|[^#\s]+)([^\n]*)')


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """An expected quantity of a case and the value of this run.

    ``from_run``: the expected value is one that this program gave before, no reference.
    """

    case: str
    quantity: str
    value: Any
    expected: Any
    tolerance: str
    origin: str
    from_run: bool
    passed: bool


def short(value: Any) -> str:
    """A value for people to read."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def read_expected(path: Path) -> dict[str, Mapping[str, Any]]:
    """Tables of expected.toml by quantity.

    Raises CaseError if the file is damaged or an entry lacks value, tolerance or origin.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CaseError(f"{path}: {error}") from error
    for name, spec in data.items():
        problem = _problem_of(spec)
        if problem:
            raise CaseError(
                f"{path}: [{name}] {problem}; each quantity has value, origin, and for numbers "
                f"tolerance (relative), at_least or at_most"
            )
    return data


def _problem_of(spec: Any) -> str:
    """Reason why an entry of expected.toml cannot be compared; empty if it can."""
    if not isinstance(spec, dict):
        return "is not a table"
    missing = [key for key in ("value", "origin") if key not in spec]
    if missing:
        return f"lacks {' and '.join(missing)}"
    if not isinstance(spec.get("from_run", False), bool):
        return "has a from_run that is neither true nor false"
    number = isinstance(spec["value"], (int, float)) and not isinstance(spec["value"], bool)
    if number and not {"tolerance", "at_least", "at_most"} & set(spec):
        return "states a number without saying how far it may be off"
    return ""


def compare(case: str, name: str, spec: Mapping[str, Any], data: Mapping[str, Any]) -> Comparison:
    """Compare one quantity; dots in its name reach into the result."""
    value = value_at(data, name)
    expected = spec["value"]
    if value is None:
        passed, shown = False, "no such value"
    elif isinstance(expected, (bool, str)) or not isinstance(value, (int, float)):
        passed, shown = value == expected, "equal"
    else:
        low = spec.get("at_least", float("-inf"))
        high = spec.get("at_most", float("inf"))
        if "tolerance" in spec:
            low = max(low, expected - abs(expected) * spec["tolerance"])
            high = min(high, expected + abs(expected) * spec["tolerance"])
        passed, shown = low <= value <= high, f"{low:.6g} to {high:.6g}"
    return Comparison(
        case=case,
        quantity=name,
        value=value,
        expected=expected,
        tolerance=shown,
        origin=spec["origin"],
        from_run=spec.get("from_run", False),
        passed=bool(passed),
    )


def value_at(data: Mapping[str, Any], name: str) -> Any:
    """Follow ``iterations.-1.limits.0.discrepancy``; None where it leads nowhere."""
    value: Any = data
    for key in name.split("."):
        if isinstance(value, Mapping):
            value = value.get(key)
            continue
        position = int(key) if re.fullmatch(r"-?\d+", key) else None
        if not isinstance(value, (list, tuple)) or position is None:
            return None
        if not -len(value) <= position < len(value):
            return None
        value = value[position]
    return value


def update_expected(path: Path, comparisons: Sequence[Comparison], *, quiet: bool) -> None:
    """Write new values in place of those that earlier runs gave and tell each; comments stay.

    A value of another origin, a formula, a paper, another program or a bar, is what a run is
    measured by: it stays, and a line says so.
    """
    new = [
        c for c in comparisons if c.value is not None and _as_toml(c.value) != _as_toml(c.expected)
    ]
    changed = {c.quantity: c for c in new if c.from_run}
    for c in new:
        if not (c.from_run or quiet):
            say(
                f"{path}: {c.quantity} stays {_as_toml(c.expected)}, found {short(c.value)}: no "
                f"from_run = true, its origin is {json.dumps(c.origin)}"
            )
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    quantity = ""
    for number, line in enumerate(lines):
        if header := _HEADER.match(line):
            quantity = header[1] or header[2]
        match = _VALUE.match(line)
        if match is None or quantity not in changed:
            continue
        value = _as_toml(changed[quantity].value)
        lines[number] = f"{match[1]}{value}{match[3]}\n"
        if not quiet:
            origin = json.dumps(changed[quantity].origin)
            say(f"{path}: {quantity} {match[2]} -> {value}; is its origin still {origin}?")
    write_text(path, "".join(lines))


def _as_toml(value: Any) -> str:
    """Write a value as TOML does; JSON agrees for text, numbers and truth values."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return json.dumps(value)
