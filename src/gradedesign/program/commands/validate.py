"""``gradedesign validate``: the regression suite over case folders."""

from __future__ import annotations

import json
import re
import time
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gradedesign.common.system.atomic import is_folder, write_text
from gradedesign.common.system.progress import Listener, counted, ignore
from gradedesign.common.system.scratch import scratch_folder
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.result import as_json as result_data
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.pipeline import run as run_case
from gradedesign.program.commands.junit import Comparison, short, write_junit
from gradedesign.program.commands.layout import say
from gradedesign.program.commands.plugins import registry_for
from gradedesign.program.commands.progress_lines import ProgressLines
from gradedesign.program.commands.show import print_json, print_table, print_text
from gradedesign.program.host.read_case import load_case

#: Exit code where a case misses an expected value: no class of error has it.
DEVIATES = 1

#: ``["iterations.-1.limits.0.discrepancy"]`` or ``[status]``, and ``value = 1.5  # comment``.
_HEADER = re.compile(r'\s*\[(?:"([^"]+)"|([^"\]]+))\]')
_VALUE = re.compile(r'(\s*value\s*=\s*)("[^"]*"|[^#\s]+)([^\n]*)')


def validate(
    folders: Sequence[Path] | None,
    keyword: str,
    *,
    update: bool,
    strict_plugins: bool,
    as_json: bool,
    junit: Path | None = None,
) -> int:
    """Run every chosen case and print the table; 1 if anything deviates.

    ``junit`` is a file that gets the comparisons too.
    """
    chosen = _case_folders(folders or [Path("cases")], keyword)
    registry = registry_for(strict_plugins=strict_plugins)
    comparisons: list[Comparison] = []
    seconds: dict[str, float] = {}
    with ProgressLines("validate", err=True, events=False) as progress:
        for folder in counted(chosen, "case", len(chosen)):
            expected, began = read_expected(folder / "expected.toml"), time.perf_counter()
            data = run_data(folder, registry, progress, price=any(map(_of_bodies, expected)))
            name = folder.resolve().name
            seconds[name] = time.perf_counter() - began
            compared = [compare(name, key, spec, data) for key, spec in expected.items()]
            comparisons += compared
            if not as_json:
                print_text(f"{folder}: {data['status']}; {data['reason']}", hang=2)
            if update and data["status"] != "failed":
                _update_expected(folder / "expected.toml", compared, quiet=as_json)
    if junit is not None:
        write_junit(junit, comparisons, seconds)
    if as_json:
        print_json([{k: getattr(c, k) for k in Comparison.__slots__} for c in comparisons])
    else:
        print_table(
            "Validation",
            ("case", "quantity", "value", "expected", "tolerance", "", "origin"),
            [
                (
                    c.case,
                    c.quantity,
                    short(c.value),
                    short(c.expected),
                    c.tolerance,
                    "ok" if c.passed else "DEVIATES",
                    c.origin,
                )
                for c in comparisons
            ],
        )
    return 0 if all(c.passed for c in comparisons) else DEVIATES


def _case_folders(folders: Sequence[Path], keyword: str) -> list[Path]:
    """Folders that hold a case and its expectations, themselves or one level down.

    Raises CaseError if none matches.
    """
    candidates = []
    for folder in folders:
        below = sorted(p for p in folder.glob("*") if p.is_dir()) if is_folder(folder) else []
        for candidate in (folder, *below):
            if (candidate / "case.toml").is_file() and (candidate / "expected.toml").is_file():
                candidates.append(candidate)
    chosen = [f for f in candidates if matches(f.resolve().name, keyword)]
    if not chosen:
        names = ", ".join(f.name for f in candidates) or "none"
        raise CaseError(
            f"no case folder matches '{keyword}' in {', '.join(map(str, folders))}; a case folder "
            f"holds case.toml and expected.toml; found: {names}"
        )
    return chosen


def matches(name: str, expression: str) -> bool:
    """Words joined by ``or`` and ``and``, each may be negated by ``not``."""
    if not expression.strip():
        return True
    return any(
        all(
            (term.removeprefix("not ").strip() not in name)
            if term.startswith("not ")
            else (term in name)
            for term in (t.strip() for t in re.split(r"\band\b", group))
        )
        for group in re.split(r"\bor\b", expression)
    )


def _of_bodies(quantity: str) -> bool:
    """Whether a quantity is one of other bodies, which no verdict rests on."""
    return quantity.split(".")[0] in ("bodies", "why_lattice")


def run_data(
    folder: Path, registry: Registry, on_event: Listener = ignore, *, price: bool = False
) -> dict[str, Any]:
    """Run a case in a temporary run folder; what result.json holds, also of a failure.

    Other bodies are sized only for their ``price``.
    """
    values = {} if price else {"run.price": False}
    with scratch_folder("validate") as temporary:
        try:
            case = load_case(folder / "case.toml", registry=registry, values=values)
            return result_data(
                run_case(case, registry, folder=temporary / "run", on_event=on_event)
            )
        except GradeDesignError as error:
            return {"status": "failed", "reason": str(error), "exit_code": error.exit_code}


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


def _update_expected(path: Path, comparisons: Sequence[Comparison], *, quiet: bool) -> None:
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
