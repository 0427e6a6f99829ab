"""``gradedesign validate``: the regression suite over case folders."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, TypeAlias

from gradedesign import GradeDesignError, load_case
from gradedesign import run as run_case
from gradedesign.commands import (
    Listener,
    ProgressLines,
    Registry,
    counted,
    ignore,
    print_files,
    print_json,
    print_table,
    print_text,
    registry_for,
    result_data,
    scratch_folder,
)
from gradedesign_validate.case_processes import CaseTask, in_processes, say_log
from gradedesign_validate.expected_values import (
    Comparison,
    compare,
    short,
    update_expected,
    value_at,
)
from gradedesign_validate.history import (
    HistoryLine,
    append_line,
    differences,
    draw_history,
    last_of,
    read_history,
    suite_key,
)
from gradedesign_validate.junit import write_junit
from gradedesign_validate.peak_memory import peak_memory
from gradedesign_validate.suite_cases import SuiteCase, case_folders, suite_case

#: Exit code where a case misses an expected value: no class of error has it.
DEVIATES = 1
#: Bytes for a case that cannot be read, whose process ends at once. Chosen, not measured.
_DAMAGED_MEMORY = 2_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidateRequest:
    """Options of the command."""

    keyword: str = ""
    update: bool = False
    strict_plugins: bool = False
    as_json: bool = False
    junit: Path | None = None  #: File that gets the comparisons too.
    #: Cases at a time, each in a process of its own; None for this process.
    jobs: int | None = None
    history: Path | None = None  #: File that gets a line of each case.
    #: Only cases of which the history has no passing line of the same case and program.
    changed: bool = False


def validate(folders: Sequence[Path] | None, request: ValidateRequest) -> int:
    """Run every chosen case and print the table; 1 if anything deviates."""
    chosen = case_folders(folders or [Path("cases")], request.keyword)
    registry = registry_for(strict_plugins=request.strict_plugins)
    past = [] if request.history is None else read_history(request.history)
    key = suite_key(registry)
    suite = [suite_case(folder, registry, key) for folder in chosen]
    if request.changed:
        suite = [case for case in suite if not _is_proven(case, past)]
        if not request.as_json:
            print_text(f"{len(suite)} of {len(chosen)} cases changed since they last passed")
    comparisons: list[Comparison] = []
    lines: list[HistoryLine] = []
    with ProgressLines("validate", err=True, events=False) as progress:
        for case, compared, line in _outcomes(suite, registry, progress, request):
            comparisons += compared
            lines.append(line)
            if not request.as_json:
                print_text(f"{case.folder}: {line.status}; {line.reason}", hang=2)
            if request.history is not None:
                append_line(request.history, line)
            if request.update and line.status != "failed":
                update_expected(case.folder / "expected.toml", compared, quiet=request.as_json)
    if request.junit is not None:
        write_junit(request.junit, comparisons, {line.case: line.seconds for line in lines})
    if request.as_json:
        print_json([asdict(c) for c in comparisons])
    elif comparisons:
        _print_comparisons(comparisons)
    if request.history is not None:
        _tell_history(request.history, past, lines, quiet=request.as_json)
    return 0 if all(c.passed for c in comparisons) else DEVIATES


def _is_proven(case: SuiteCase, past: Sequence[HistoryLine]) -> bool:
    """Whether the last passing line of a case is of this very case and program."""
    last = last_of([line for line in past if line.passed], case.name)
    return last is not None and bool(case.case_hash) and last.cause == case.cause


_Outcome: TypeAlias = tuple[SuiteCase, list[Comparison], HistoryLine]


def _outcomes(
    suite: Sequence[SuiteCase], registry: Registry, progress: Listener, request: ValidateRequest
) -> Iterator[_Outcome]:
    """Run the cases, here or in processes of their own, and tell the end of each."""
    if request.jobs is None:
        for case in counted(suite, "case", len(suite)):
            began = time.perf_counter()
            with peak_memory() as peak:
                price = any(map(_of_bodies, case.expected))
                data = run_data(case.folder, registry, progress, price=price)
                held = peak()
            yield _outcome(case, data, time.perf_counter() - began, held)
        return
    # A damaged case ends at once: any memory will do.
    cases = {case.folder: case for case in suite}
    tasks = [CaseTask(folder=c.folder, memory=c.memory or _DAMAGED_MEMORY) for c in suite]
    for end in in_processes(tasks, request.jobs, strict_plugins=request.strict_plugins):
        case = cases[end.folder]
        say_log(end)
        if end.answer:
            line = HistoryLine(**json.loads(end.line))
            yield case, [Comparison(**entry) for entry in json.loads(end.answer)], line
        else:
            data = {"status": "failed", "reason": end.reason}
            yield _outcome(case, data, end.seconds, end.peak_bytes)


def _outcome(case: SuiteCase, data: Mapping[str, Any], seconds: float, held: int) -> _Outcome:
    """Comparisons of a case, and its line for a history."""
    compared = [compare(case.name, key, spec, data) for key, spec in case.expected.items()]
    first = value_at(data, "iterations.0.limits") or ()
    off = [row["discrepancy"] for row in first if row["discrepancy"] is not None]
    line = HistoryLine(
        case=case.name,
        version=metadata.version("gradedesign"),
        case_hash=case.case_hash,
        text_key=case.text_key,
        program_key=case.program_key,
        date=datetime.now(tz=UTC).isoformat(timespec="seconds"),
        status=data["status"],
        reason=data["reason"],
        passed=all(c.passed for c in compared),
        mass_g=data.get("mass_g"),
        discrepancy=max(off, key=abs, default=None),
        seconds=seconds,
        peak_bytes=held,
        values={c.quantity: c.value for c in compared},
    )
    return case, compared, line


def _print_comparisons(comparisons: Sequence[Comparison]) -> None:
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


def _tell_history(
    path: Path, past: Sequence[HistoryLine], lines: Sequence[HistoryLine], *, quiet: bool
) -> None:
    """Draw the cases that ran, and print what moved against the last line of each."""
    pictures = [draw_history(path, [*past, *lines], line.case).name for line in lines]
    if quiet:
        return
    earlier = ((last_of(past, line.case), line) for line in lines)
    moved = [row for last, line in earlier if last for row in differences(last, line)]
    if moved:
        columns = ("case", "quantity", "before", "now", "change")
        print_table("Moved against the last line of the history", columns, moved)
    print_files(path.parent, [path.name, *pictures])


def _of_bodies(quantity: str) -> bool:
    """Whether a quantity is one of other bodies, which no verdict rests on."""
    return quantity.split(".")[0] in ("bodies", "why_lattice")


def run_data(
    folder: Path, registry: Registry, on_event: Listener = ignore, *, price: bool = False
) -> dict[str, Any]:
    """Run a case in a temporary run folder; what result.json holds, also of a failure.

    Other bodies are sized only for their ``price``.
    """
    with scratch_folder("validate") as temporary:
        try:
            case = load_case(folder / "case.toml", registry=registry)
            if not (price or case.lattice.stated):
                values = {"run.price": False}
                case = load_case(folder / "case.toml", registry=registry, values=values)
            return result_data(
                run_case(case, registry, folder=temporary / "run", on_event=on_event)
            )
        except GradeDesignError as error:
            return {"status": "failed", "reason": str(error), "exit_code": error.exit_code}
