"""The ladder: from a case to the lightest lattice that was found to meet its limits.

Read this first. Part, solid analysis; then rounds of sizing on the homogenised part, explicit
analysis and correction; then acceptance on the exported surface, whose values decide; a miss goes
round again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix

from gradedesign.case.schema import Case
from gradedesign.errors import GradeDesignError
from gradedesign.ladder.accepted import Accepted, accept_design, export_surface
from gradedesign.ladder.announce import Announcer
from gradedesign.ladder.files import Shown, write_outputs, write_result
from gradedesign.ladder.graded_cells import with_cells
from gradedesign.ladder.oriented import oriented
from gradedesign.ladder.own_cell import with_own_cell
from gradedesign.ladder.result import RunResult
from gradedesign.ladder.round import design_filter, size_round
from gradedesign.ladder.rounds import Analysed, Round, analyse_design, play_round
from gradedesign.ladder.setup import Setup, prepare
from gradedesign.ladder.solid import solid_rows, solve_solid
from gradedesign.ladder.stages import default_folder, load_rounds, open_stages, save_round
from gradedesign.ladder.summary import (
    best_round,
    infeasible_result,
    partial_result,
    verdict_result,
)
from gradedesign.ladder.verdict import LimitRow, all_hold, is_tight
from gradedesign.plugin.registry import Registry, build_registry
from gradedesign.verify.correction import Correction
from gradedesign.workspace.limits import Deadline
from gradedesign.workspace.progress import Listener, ignore
from gradedesign.workspace.run_folder import RunFolder

#: A round after the second is only begun if this many times the last one's duration is left.
ROUND_RESERVE = 1.3
#: Use that sizing aims at when no explicit analysis follows it.
FULL_USE = 0.998
#: Densities that differ by less are the same design.
SAME_DENSITY = 1e-4


def run(
    case: Case,
    registry: Registry | None = None,
    *,
    folder: Path | None = None,
    on_event: Listener = ignore,
    resume: bool = False,
    overwrite: bool = False,
) -> RunResult:
    """Run the whole loop on a case.

    Parameters
    ----------
    case : Case
        From `load_case`.
    registry : Registry, optional
        Cells, laws, materials and formats; the installed ones by default.
    folder : Path, optional
        Run folder; ``runs/<case name>`` below the working folder by default.
    on_event : callable, optional
        Receives every progress event.
    resume : bool
        Go on from the last finished stage of an interrupted run.
    overwrite : bool
        Replace the results of an earlier run.

    Returns
    -------
    RunResult
        Also written to ``result.json``. ``not_met`` and ``infeasible`` are results.

    Raises
    ------
    GradeDesignError
        Whatever stopped the run, by name; ``result.json`` then says ``failed``.
    """
    registry = build_registry() if registry is None else registry
    target = default_folder(case) if folder is None else folder
    with open_stages(target, case, resume=resume, overwrite=overwrite) as out:
        announce = Announcer(on_event)
        try:
            result = climb(case, registry, out, announce)
        except GradeDesignError as error:
            write_result(
                out,
                RunResult(
                    status="failed",
                    lightest=False,
                    reason=str(error),
                    case_hash=case.case_hash,
                    case_name=case.name,
                    folder=out.path,
                    timing_s=announce.timing(),
                ),
            )
            raise
        return result


def climb(case: Case, registry: Registry, out: RunFolder, announce: Announcer) -> RunResult:
    """Climb the rungs in order and write what was found."""
    deadline = Deadline(case.run.time)
    registry = with_own_cell(case, registry)
    with announce.stage("part"):
        setup = prepare(case, registry, announce.listener)
    announce.part(setup)
    with announce.stage("solid"):
        solutions = solve_solid(setup)
        rows = solid_rows(setup, solutions)
    announce.limits("solid", rows)
    if not all_hold(rows):
        result = infeasible_result(setup, registry, rows)
        return write_outputs(out, setup, result, announce, solid=solutions)
    if case.run.stop_after == "solid":
        result = partial_result(setup, registry, rows, "solid")
        return write_outputs(out, setup, result, announce, solid=solutions)
    setup = oriented(setup, solutions)
    if case.run.stop_after in ("sizing", "lattice"):
        return stop_early(setup, registry, out, announce)
    return loop(setup, registry, out, announce, deadline)


def stop_early(setup: Setup, registry: Registry, out: RunFolder, announce: Announcer) -> RunResult:
    """Size once, and stop there or after building the lattice."""
    start = Correction(displacement=(1.0,) * len(setup.displacement_limits))
    with announce.stage("sizing"):
        sized = size_round(
            setup,
            start,
            {},
            design_filter(setup),
            start=None,
            target=FULL_USE,
            most_iterations=60,
            on_step=announce.sizing_step,
        )
    setup = with_cells(setup, sized.rho)
    result = partial_result(setup, registry, (), setup.case.run.stop_after, sized=sized)
    return write_outputs(out, setup, result, announce, rho=sized.rho)


def loop(
    setup: Setup, registry: Registry, out: RunFolder, announce: Announcer, deadline: Deadline
) -> RunResult:
    """Play rounds until a design is accepted, or rounds or time run out."""
    rounds = load_rounds(out, setup)
    for done in rounds:
        announce.round(done, resumed=True)
    factors: dict[str, float] = {}
    accepted: Accepted | None = None
    analysed: Analysed | None = None
    tried: set[int] = set()
    matrix: csr_matrix | None = None
    while True:
        if rounds and rounds[-1].iteration.round not in tried and _ready(rounds[-1], factors):
            tried.add(rounds[-1].iteration.round)
            latest = judge(setup, out, announce, deadline, rounds[-1], analysed)
            accepted = _better(accepted, latest)
            if latest.holds and is_tight(latest.rows, at_lower_bound=rounds[-1].at_lower_bound):
                break
            factors = latest.factors
        if len(rounds) >= setup.case.run.max_rounds or _out_of_time(rounds, deadline):
            break
        with announce.stage("round", f"{len(rounds) + 1} of {setup.case.run.max_rounds} at most"):
            matrix = design_filter(setup) if matrix is None else matrix
            done, analysed = play_round(
                setup, rounds, factors, matrix, on_step=announce.sizing_step
            )
        rounds = (*rounds, done)
        save_round(out, setup, done)
        announce.round(done)
        if _stuck(rounds):
            break
    if accepted is None or not accepted.holds:
        accepted = best_left(setup, out, announce, deadline, rounds, factors, tried) or accepted
    result = verdict_result(setup, registry, rounds, accepted, deadline)
    if accepted is None:
        best = best_round(rounds)
        with announce.stage("explicit"):
            analysed = analyse_design(setup, best.rho)
            surface, _ = export_surface(setup, out, analysed)
        shown = Shown(rho=best.rho, analysed=analysed, surface=surface)
    else:
        shown = Shown(rho=accepted.round.rho, analysed=accepted.analysed, surface=accepted.surface)
    return write_outputs(out, setup, result, announce, shown=shown)


def judge(
    setup: Setup,
    out: RunFolder,
    announce: Announcer,
    deadline: Deadline,
    done: Round,
    analysed: Analysed | None,
) -> Accepted:
    """Export the surface of a round's design and have it accepted or refused."""
    if analysed is None:
        with announce.stage("explicit"):
            analysed = analyse_design(setup, done.rho)
    with announce.stage("acceptance"):
        accepted = accept_design(setup, out, done, analysed, deadline, announce)
    announce.limits("acceptance", accepted.rows)
    return accepted


def best_left(
    setup: Setup,
    out: RunFolder,
    announce: Announcer,
    deadline: Deadline,
    rounds: Sequence[Round],
    factors: dict[str, float],
    tried: set[int],
) -> Accepted | None:
    """Accept the lightest earlier design that held every limit, if there is one left."""
    left = [r for r in rounds if r.iteration.round not in tried and _holds(r.rows, factors)]
    for done in sorted(left, key=lambda r: r.iteration.mass_g):
        accepted = judge(setup, out, announce, deadline, done, None)
        if accepted.holds:
            return accepted
    return None


def _better(one: Accepted | None, other: Accepted) -> Accepted:
    """The one that holds; of two, the lighter; of none, the later."""
    if one is None or not one.holds:
        return other
    if not other.holds:
        return one
    return min(one, other, key=lambda a: a.round.iteration.mass_g)


def _holds(rows: Sequence[LimitRow], factors: dict[str, float]) -> bool:
    return all(row.use * factors.get(row.name, 1.0) <= 1.0 for row in rows)


def _ready(done: Round, factors: dict[str, float]) -> bool:
    """Limits hold in the explicit analysis, with what acceptance taught, and one is used."""
    rows = [replace(r, value=r.value * factors.get(r.name, 1.0)) for r in done.rows]
    return all_hold(rows) and is_tight(rows, at_lower_bound=done.at_lower_bound)


def _stuck(rounds: Sequence[Round]) -> bool:
    """The design breaks a limit and is the last one again: no round can change it."""
    if len(rounds) < 2 or rounds[-1].iteration.passed:
        return False
    return bool(np.abs(rounds[-1].rho - rounds[-2].rho).max() < SAME_DENSITY)


def _out_of_time(rounds: Sequence[Round], deadline: Deadline) -> bool:
    if not rounds:
        return False
    # The first round of all also compiles, so it is reserve enough for the second.
    reserve = ROUND_RESERVE if len(rounds) > 1 else 1.0
    return deadline.remaining() < reserve * rounds[-1].iteration.seconds
