"""``gradedesign sweep``: many designs of one case side by side, into one table and one plot."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import psutil

from gradedesign import GradeDesignError, load_case
from gradedesign import run as run_case
from gradedesign.commands import (
    Cluster,
    ProgressLines,
    build_registry,
    counted,
    has_dask,
    on_dask,
    print_files,
    print_json,
    print_table,
    print_text,
    registry_for,
    say,
    usable_cores,
    wrapped,
)
from gradedesign_sweep.study import Design, Study, key_names, load_study
from gradedesign_sweep.sweep_files import write_plot, write_tables
from gradedesign_sweep.sweep_folder import (
    PLOT,
    TABLE,
    design_case,
    design_name,
    earlier_seconds,
    is_finished,
    open_sweep,
    read_result,
    run_folder,
    write_design,
)
from gradedesign_sweep.table import (
    BEST_WORDS,
    FAILED,
    DesignRow,
    design_row,
    designs_table,
    table_json,
)

#: How a design's run ended: the message of its error or none, its exit code, and seconds.
Outcome: TypeAlias = tuple[str, int, float]

#: Exit code where every design failed with something that is no error of gradedesign.
_INTERNAL = 70


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepRequest:
    """Options of the command.

    Attributes
    ----------
    workers : int or None
        Processes on this machine; by default as many as it has processors and memory for.
    scheduler : str or None
        Address of a running dask cluster, used instead.
    """

    workers: int | None = None
    scheduler: str | None = None
    allow_outside: bool = False
    strict_plugins: bool = False
    as_json: bool = False


def sweep(path: Path, output: Path | None, request: SweepRequest) -> int:
    """Run every design of a study, write the table and the plot, and print a summary.

    Parameters
    ----------
    path : Path
        The study file.
    output : Path or None
        Folder; ``runs/<name of the study>`` by default. An earlier sweep there goes on: designs
        that are finished are not run again.

    Returns
    -------
    int
        0; where every design failed, the exit code of the last one.

    Raises
    ------
    CaseError
        If the study cannot be read, the folder is none of a sweep or in use, or dask is missing.
    """
    registry = registry_for(strict_plugins=request.strict_plugins)
    study = load_study(path, registry, allow_outside=request.allow_outside)
    plain = re.sub(r"[^\w.-]+", "-", study.name).strip("-.") or "sweep"
    with open_sweep(Path("runs") / plain if output is None else output) as folder:
        rows, code = _run_designs(study, folder, request)
        best = write_tables(folder, study, rows)
        write_plot(folder, study, rows, best)
    if request.as_json:
        print_json(table_json(study, rows, best))
    else:
        _print_summary(study, rows, best, folder)
    return code if all(row.status == FAILED for row in rows) else 0


def _run_designs(study: Study, folder: Path, request: SweepRequest) -> tuple[list[DesignRow], int]:
    """Run what is not finished; the rows of the table, and the exit code of the last failure."""
    quiet = request.as_json
    seconds = earlier_seconds(folder)
    rows: dict[int, DesignRow] = {}
    waiting: dict[str, Design] = {}
    code = 0
    with ProgressLines("sweep", err=quiet, events=False):
        for design in counted(study.designs, "design", len(study.designs)):
            place = write_design(folder, study, design)
            name = design_name(design)
            if is_finished(design, place):
                rows[design.number] = design_row(
                    design, name, read_result(place), seconds=seconds.get(name)
                )
            else:
                rows[design.number] = design_row(design, name, None)
                waiting[str(place)] = design
        if len(waiting) < len(rows):
            done = len(rows) - len(waiting)
            say(f"{done} of {len(rows)} designs are finished already and not run again", err=quiet)
        for place_text, (error, ended_with, took) in _outcomes(waiting, request):
            design = waiting[place_text]
            result = read_result(Path(place_text))
            if result is None and not error:
                error = (
                    f"its run ended without a result in {place_text}: workers on other machines "
                    f"must have this folder too"
                )
            row = design_row(design, design_name(design), result, error=error, seconds=took)
            rows[design.number] = row
            code = ended_with or code
            say("\n".join(wrapped(_line(row, len(rows)), hang=2)), err=quiet)
            # So that a sweep that is killed leaves what it knows.
            write_tables(folder, study, list(rows.values()))
    return list(rows.values()), code


def _run_design(place: str) -> Outcome:
    """Run one design in whatever process this is, from where it was interrupted."""
    began = time.monotonic()
    folder = Path(place)
    message, code = "", 0
    try:
        registry = build_registry()
        case = load_case(design_case(folder), allow_outside=True, registry=registry)
        run_case(case, registry, folder=run_folder(folder), resume=True)
    except GradeDesignError as error:
        message, code = str(error), error.exit_code
    except Exception as error:  # noqa: BLE001 - any trouble
        # One design's trouble is a row of the table, whatever it is.
        message, code = f"internal error: {error!r}", _INTERNAL
    return message, code, time.monotonic() - began


def _outcomes(
    waiting: Mapping[str, Design], request: SweepRequest
) -> Iterator[tuple[str, Outcome]]:
    """Outcome of each design, in the order in which they end."""
    if not waiting:
        return
    count = min(request.workers or default_workers(list(waiting.values())), len(waiting))
    if request.scheduler is None:
        _warn_of_memory(list(waiting.values()), count, err=request.as_json)
        if count == 1:
            for place in counted(waiting, "design", len(waiting)):
                yield place, _run_design(place)
            return
    threads = max(1, usable_cores() // count) if request.scheduler is None else None
    cluster = Cluster(workers=count, scheduler=request.scheduler, threads=threads)
    tasks = [(place,) for place in waiting]
    for task, future in on_dask(_run_design, tasks, cluster, text="designs side by side"):
        lost = future.exception()
        if lost is None:
            yield task[0], future.result()
        else:
            yield task[0], (f"its worker ended: {lost}; for want of memory?", _INTERNAL, 0.0)


def default_workers(designs: Sequence[Design]) -> int:
    """Processes that this machine has processors and memory for; 1 without dask."""
    if not has_dask():
        return 1
    most = max(design.case.run.memory for design in designs)
    return max(1, min(usable_cores(), int(psutil.virtual_memory().total // most)))


def _warn_of_memory(designs: Sequence[Design], workers: int, *, err: bool) -> None:
    """Say when the designs that run side by side may take more memory than there is."""
    budgets = sorted((design.case.run.memory for design in designs), reverse=True)[:workers]
    there = psutil.virtual_memory().total
    if sum(budgets) > there:
        warning = (
            f"warning: {workers} designs side by side may take [run] memory of "
            f"{sum(budgets) / 1e9:.3g} GB together, but this machine has {there / 1e9:.3g} GB; "
            f"take fewer --workers, or state less memory"
        )
        say("\n".join(wrapped(warning, hang=2)), err=err)


def _line(row: DesignRow, count: int) -> str:
    """One line when a design ends."""
    began = f"design {row.number} of {count} ({row.label}): {row.status}"
    if row.status == FAILED:
        return f"{began}: {row.error}"
    mass = "" if row.mass_g is None else f", {row.mass_g:.4g} g"
    utilisation = "" if row.utilisation is None else f", {row.utilisation:.1%} of a limit"
    took = "" if row.seconds is None else f" ({row.seconds:.0f} s)"
    return f"{began}{', lightest' if row.lightest else ''}{mass}{utilisation}{took}"


def _print_summary(
    study: Study, rows: Sequence[DesignRow], best: frozenset[int], folder: Path
) -> None:
    """Print the table in short: what each design weighs, and the limit that it uses most."""
    say("")
    names = ", ".join(key_names(study).values())
    print_table(f"{study.name}: {len(rows)} designs", *designs_table(names, rows, best))
    for row in rows:
        if row.status == FAILED:
            print_text(f"design {row.number} failed: {row.error}", hang=2)
    print_text(BEST_WORDS, hang=2)
    files = [f"{TABLE}.csv", f"{TABLE}.json", PLOT]
    print_files(folder, [name for name in files if (folder / name).is_file()])
