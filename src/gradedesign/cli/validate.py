"""``gradedesign validate``: the regression suite over case folders."""

from __future__ import annotations

import re
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from gradedesign.case.read_case import load_case
from gradedesign.cli.show import print_json, print_table
from gradedesign.errors import CaseError, GradeDesignError
from gradedesign.ladder.result import as_json as result_data
from gradedesign.pipeline import run as run_case
from gradedesign.workspace.atomic import write_text

DEVIATES = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One expected quantity of one case beside what came out."""

    case: str
    quantity: str
    value: Any
    expected: Any
    tolerance: str
    origin: str
    passed: bool


def validate(folders: Sequence[Path] | None, keyword: str, *, update: bool, as_json: bool) -> int:
    """Run every chosen case and print the table; 1 if anything deviates."""
    chosen = case_folders(folders or [Path("cases")], keyword)
    comparisons: list[Comparison] = []
    for folder in chosen:
        if not as_json:
            typer.echo(f"running {folder}")
        found = run_and_compare(folder)
        comparisons += found
        if update:
            update_expected(folder / "expected.toml", found)
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
                    _short(c.value),
                    _short(c.expected),
                    c.tolerance,
                    "ok" if c.passed else "DEVIATES",
                    c.origin,
                )
                for c in comparisons
            ],
        )
    return 0 if all(c.passed for c in comparisons) else DEVIATES


def case_folders(folders: Sequence[Path], keyword: str) -> list[Path]:
    """Folders that hold a case and its expectations, themselves or one level down.

    Raises
    ------
    CaseError
        If none matches.
    """
    found = []
    for folder in folders:
        for candidate in [folder, *sorted(p for p in folder.glob("*") if p.is_dir())]:
            if (candidate / "case.toml").is_file() and (candidate / "expected.toml").is_file():
                found.append(candidate)
    chosen = [f for f in found if matches(f.resolve().name, keyword)]
    if not chosen:
        names = ", ".join(f.name for f in found) or "none"
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


def run_and_compare(folder: Path) -> list[Comparison]:
    """Run a case in a temporary run folder and compare every expected quantity."""
    expected = read_expected(folder / "expected.toml")
    with tempfile.TemporaryDirectory(prefix="gradedesign-validate-") as temporary:
        try:
            case = load_case(folder / "case.toml")
            data = result_data(run_case(case, folder=Path(temporary) / "run"))
        except GradeDesignError as error:
            data = {"status": "failed", "reason": str(error)}
    return [compare(folder.resolve().name, name, spec, data) for name, spec in expected.items()]


def read_expected(path: Path) -> dict[str, Mapping[str, Any]]:
    """Tables of expected.toml by quantity.

    Raises
    ------
    CaseError
        If the file is damaged or an entry lacks value, tolerance or origin.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CaseError(f"{path}: {error}") from error
    for name, spec in data.items():
        missing = {"value", "origin"} - set(spec) if isinstance(spec, dict) else {"value"}
        if missing:
            raise CaseError(
                f"{path}: [{name}] lacks {', '.join(sorted(missing))}; each quantity has value, "
                f"origin, and tolerance (relative), or at_least and at_most"
            )
    return data


def compare(case: str, name: str, spec: Mapping[str, Any], data: Mapping[str, Any]) -> Comparison:
    """Compare one quantity; dots in its name reach into the result."""
    value: Any = data
    for key in name.split("."):
        if isinstance(value, Mapping):
            value = value.get(key)
        elif isinstance(value, list) and key.lstrip("-").isdigit() and value:
            value = value[int(key)]
        else:
            value = None
    expected = spec["value"]
    tolerance = spec.get("tolerance")
    if value is None:
        passed, shown = False, "no such value"
    elif isinstance(expected, (bool, str)):
        passed, shown = value == expected, "equal"
    else:
        low = spec.get("at_least", float("-inf"))
        high = spec.get("at_most", float("inf"))
        if tolerance is not None:
            low = max(low, expected - abs(expected) * tolerance)
            high = min(high, expected + abs(expected) * tolerance)
        passed, shown = low <= value <= high, f"{low:.6g} to {high:.6g}"
    return Comparison(
        case=case,
        quantity=name,
        value=value,
        expected=expected,
        tolerance=shown,
        origin=spec["origin"],
        passed=bool(passed),
    )


def update_expected(path: Path, comparisons: Sequence[Comparison]) -> None:
    """Write new values in place of the old ones and print each change."""
    text = path.read_text(encoding="utf-8")
    for c in comparisons:
        if c.value is None or c.value == c.expected:
            continue
        new = f'"{c.value}"' if isinstance(c.value, str) else str(c.value).lower()
        if isinstance(c.value, float):
            new = f"{c.value:.6g}"
        header = re.escape(f'["{c.quantity}"]') + "|" + re.escape(f"[{c.quantity}]")
        pattern = re.compile(rf"((?:{header})[^\[]*?\bvalue\s*=\s*)([^\n#]+)")
        text, count = pattern.subn(lambda m, new=new: m[1] + new, text, count=1)
        if count:
            typer.echo(f"{path}: {c.quantity} {c.expected} -> {new}")
    write_text(path, text)


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
