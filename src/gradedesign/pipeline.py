"""The ladder: from a case to the lightest lattice that was found to meet its limits.

Read this first. Part, solid analysis; then rounds of sizing on the homogenised part, explicit
analysis and correction; then acceptance: the exported surface, meshed again whole, decides, or its
most stressed windows correct the stress of the explicit analysis; a miss goes round again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scipy.sparse import csr_matrix

from gradedesign.case.schema import Case
from gradedesign.errors import GradeDesignError, LatticeError, MeshError, ResourceError
from gradedesign.ladder.accepted import Accepted, accept_design, export_surface
from gradedesign.ladder.announce import Announcer
from gradedesign.ladder.ended import TIGHT_END, refused_end, why_ended
from gradedesign.ladder.files import Shown, write_outputs, write_result
from gradedesign.ladder.finished import finished_result
from gradedesign.ladder.graded_cells import with_cells
from gradedesign.ladder.oriented import oriented
from gradedesign.ladder.own_cell import with_own_cell
from gradedesign.ladder.result import RunResult
from gradedesign.ladder.round import design_filter, size_round
from gradedesign.ladder.rounds import Analysed, Round, analyse_design, play_round
from gradedesign.ladder.run_cost import RunCost
from gradedesign.ladder.setup import Setup, prepare
from gradedesign.ladder.solid import solve_solid, with_solid
from gradedesign.ladder.stages import (
    default_folder,
    load_acceptance,
    load_rounds,
    open_stages,
    save_acceptance,
    save_round,
)
from gradedesign.ladder.summary import (
    best_round,
    infeasible_result,
    partial_result,
    verdict_result,
)
from gradedesign.ladder.verdict import Factors, all_hold, is_tight, with_factors
from gradedesign.plugin.registry import Registry, build_registry
from gradedesign.verify.correction import Correction
from gradedesign.workspace.progress import Listener, ignore
from gradedesign.workspace.run_folder import RunFolder

#: Use that sizing aims at when no explicit analysis follows it.
FULL_USE = 0.998


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
        Go on from the last finished stage of a run that was interrupted, failed, or was ended by
        time or rounds of which there are more now; a finished one returns its result at once.
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
        done = finished_result(out, case) if resume else None
        if done is not None:
            announce.say("resume", f"{out.path} holds the result of this case; nothing is run")
            return done
        try:
            result = climb(case, registry, out, announce)
        except GradeDesignError as error:
            write_result(
                out,
                RunResult(
                    status="failed",
                    ended_by="error",
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
    cost = RunCost(budget=case.run)
    registry = with_own_cell(case, registry)
    with announce.stage("part"):
        setup = prepare(case, registry, announce.listener)
    announce.part(setup)
    with announce.stage("solid"):
        solutions = solve_solid(setup)
        setup = with_solid(setup, solutions)
        rows = setup.solid
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
    cost.predict(setup, rows, announce)
    return loop(setup, registry, out, announce, cost)


def stop_early(setup: Setup, registry: Registry, out: RunFolder, announce: Announcer) -> RunResult:
    """Size once, and stop there or after building the lattice."""
    with announce.stage("sizing"):
        sized = size_round(
            setup,
            Correction(),
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
    setup: Setup, registry: Registry, out: RunFolder, announce: Announcer, cost: RunCost
) -> RunResult:
    """Play rounds until a design is accepted, no round can help, or rounds or time run out."""
    rounds = load_rounds(out, setup)
    for done in rounds:
        announce.round(done, resumed=True)
    deadline = cost.deadline(rounds)
    refused, factors = load_acceptance(out, setup, len(rounds))
    tried = set(refused)
    accepted: Accepted | None = None
    analysed: Analysed | None = None
    matrix: csr_matrix | None = None
    while True:
        if rounds and rounds[-1].iteration.round not in tried and _ready(rounds[-1], factors):
            tried.add(rounds[-1].iteration.round)
            latest = judge(setup, out, announce, rounds[-1], analysed)
            accepted = _better(accepted, latest)
            if latest.holds and is_tight(latest.rows, at_lower_bound=rounds[-1].at_lower_bound):
                ended = TIGHT_END
                break
            factors = latest.factors
            if not latest.holds:
                refused = (*refused, rounds[-1].iteration.round)
            save_acceptance(out, setup, refused, factors)
        stop = why_ended(setup, rounds, factors, deadline)
        if stop is not None:
            ended = stop
            break
        with announce.stage("round", f"{len(rounds) + 1} of {setup.case.run.max_rounds} at most"):
            matrix = design_filter(setup) if matrix is None else matrix
            try:
                done, analysed = play_round(
                    setup,
                    rounds,
                    factors,
                    matrix,
                    on_step=announce.sizing_step,
                    on_event=announce.listener,
                )
            except (LatticeError, MeshError, ResourceError) as error:
                if not rounds:
                    raise
                # What earlier rounds found is not lost with a design that cannot be analysed.
                ended = refused_end(rounds, error)
                break
        rounds = (*rounds, done)
        save_round(out, setup, done)
        announce.round(done)
        cost.learn(rounds, announce)
    if accepted is None or not accepted.holds:
        accepted = best_left(setup, out, announce, rounds, factors, tried) or accepted
    if accepted is None and refused:
        # Refused before this process: its rows are what decided.
        accepted = judge(setup, out, announce, rounds[refused[-1] - 1], None)
    result = verdict_result(setup, registry, rounds, accepted, ended)
    result = replace(result, predicted=cost.data())
    return write_outputs(
        out, setup, result, announce, shown=shown_design(setup, out, announce, rounds, accepted)
    )


def shown_design(
    setup: Setup,
    out: RunFolder,
    announce: Announcer,
    rounds: Sequence[Round],
    accepted: Accepted | None,
) -> Shown:
    """The judged design, or the best that was found, whose surface is then exported."""
    if accepted is not None:
        return Shown(rho=accepted.round.rho, analysed=accepted.analysed, surface=accepted.surface)
    best = best_round(rounds)
    with announce.stage("explicit"):
        analysed = analyse_design(setup, best.rho, on_event=announce.listener)
        surface, _ = export_surface(setup, out, analysed)
    return Shown(rho=best.rho, analysed=analysed, surface=surface)


def judge(
    setup: Setup,
    out: RunFolder,
    announce: Announcer,
    done: Round,
    analysed: Analysed | None,
) -> Accepted:
    """Export the surface of a round's design and have it accepted or refused."""
    if analysed is None:
        with announce.stage("explicit"):
            analysed = analyse_design(setup, done.rho, on_event=announce.listener)
    with announce.stage("acceptance"):
        accepted = accept_design(setup, out, done, analysed, announce)
    announce.limits("acceptance", accepted.rows)
    return accepted


def best_left(
    setup: Setup,
    out: RunFolder,
    announce: Announcer,
    rounds: Sequence[Round],
    factors: Factors,
    tried: set[int],
) -> Accepted | None:
    """Accept the lightest earlier design that held every limit, if there is one left."""
    left = [
        r
        for r in rounds
        if r.iteration.round not in tried and all_hold(with_factors(r.rows, factors))
    ]
    for done in sorted(left, key=lambda r: r.iteration.mass_g):
        accepted = judge(setup, out, announce, done, None)
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


def _ready(done: Round, factors: Factors) -> bool:
    """Limits hold in the explicit analysis, with what acceptance taught, and one is used."""
    rows = with_factors(done.rows, factors)
    return all_hold(rows) and is_tight(rows, at_lower_bound=done.at_lower_bound)
