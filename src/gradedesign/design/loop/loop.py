"""The loop over designs: iterate until one is accepted, no iteration can help, or a budget ends.

It depends on no mesh, solver or file: the steps of an iteration are injected as `Stages`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.ended import (
    TIGHT_END,
    Ended,
    heavier_end,
    refused_end,
    unaccepted_end,
    unjudged_end,
)
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.left_designs import NEAR, decides, enclosed_by, is_ready, judge_left
from gradedesign.design.loop.loop_stages import Judged, Stages
from gradedesign.errors import LatticeError, MeshError, ResourceError, SolverError
from gradedesign.mechanics.limits.verdict import (
    Factors,
    all_hold,
    is_tight,
    mean_factors,
    with_factors,
    worst_utilisation,
)

#: Designs in succession that could be analysed at one resolution only, after which no other is
#: tried: those of one case need much the same.
_MOST_UNJUDGED = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """State of a run between iterations, with which a resumed run begins."""

    iterations: tuple[DesignIteration, ...] = ()  #: Finished, in order.
    refused: tuple[int, ...] = ()  #: Numbers of the iterations whose design acceptance refused.
    #: By a limit's key. Accepted over explicit value.
    factors: Factors = field(default_factory=dict)
    last: Judged | None = None  #: Design that was judged last.

    @property
    def counting(self) -> Factors:
        """Factors of the last acceptance; before any, those that the last iteration expects."""
        if self.last is None and self.iterations:
            return self.iterations[-1].expected
        return self.factors


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Last state of the loop."""

    iterations: tuple[DesignIteration, ...]
    #: The lightest design that acceptance held, else the last that it refused; None if none came so
    #: far.
    accepted: Accepted | None
    ended: Ended


@dataclass(slots=True, kw_only=True)
class _Run:
    """State of the loop between its steps."""

    iterations: tuple[DesignIteration, ...]  #: As in `Progress`.
    refused: tuple[int, ...]  #: As in `Progress`.
    factors: Factors  #: As in `Progress`.
    last: Judged | None  #: As in `Progress`.
    tried: set[int]  #: Numbers of the iterations whose design was judged.
    #: The lightest design that was held, else the last one that was refused.
    accepted: Accepted | None = None
    #: Of the last iteration, until its design is judged or another one begins.
    analysed: Analysed | None = None
    unjudged: int = 0  #: Designs in succession that could be analysed at one resolution only.


def run_loop(stages: Stages, start: Progress | None = None) -> Outcome:
    """Iterate until a design is accepted, none can help, or iterations or time run out.

    ``start``: of the run that is resumed. Raises `LatticeError`, `MeshError`, `ResourceError` if
    the first design cannot be built or analysed. A later one that cannot ends the loop, and so does
    one that cannot be judged.
    """
    start = Progress() if start is None else start
    run = _Run(
        iterations=start.iterations,
        refused=start.refused,
        factors=start.counting,
        last=start.last,
        tried=set(start.refused),
    )
    try:
        accepted, ended = _judged(stages, run)
    except (LatticeError, MeshError, ResourceError, SolverError) as error:
        if not run.iterations:
            raise
        # A file, an analysis or a comparison of acceptance failed: what iterations found stays.
        accepted, ended = _held(run), unaccepted_end(error)
    if accepted is not None and accepted.postponed:
        accepted = stages.judge_stress(accepted)
    return Outcome(iterations=run.iterations, accepted=accepted, ended=ended)


def _judged(stages: Stages, run: _Run) -> tuple[Accepted | None, Ended]:
    """The design that acceptance held or refused last, and what ended the loop."""
    ended: Ended | None = None
    while ended is None:
        design = _to_judge(stages, run)
        ended = _iterate(stages, run) if design is None else _judge(stages, run, design)
    left = replace(stages, accept=lambda design, _: _accept(stages, run, design))
    accepted, ended = judge_left(
        left, run.iterations, run.factors, run.last, _held(run), ended, run.tried
    )
    accepted = accepted or run.accepted
    if accepted is None and run.refused:
        # Refused before this process: its rows are what decided.
        accepted = stages.accept(run.iterations[run.refused[-1] - 1], None)
    return accepted, ended


def _held(run: _Run) -> Accepted | None:
    """The design that acceptance held, if any."""
    return run.accepted if run.accepted is not None and run.accepted.holds else None


def _to_judge(stages: Stages, run: _Run) -> DesignIteration | None:
    """The design that acceptance judges before another iteration, if any.

    The last one, or after an acceptance an earlier one that by its factors uses a limit: what an
    analysis found of it is surer than the prediction for a new one.
    """
    if not run.iterations:
        return None
    latest = run.iterations[-1]
    if latest.summary.number not in run.tried and (
        is_ready(latest, run.factors)
        or decides(latest, run.accepted, run.factors)
        or _teaches(run.iterations, run.factors, run.tried)
    ):
        return latest
    most = inf
    if run.accepted is not None and run.accepted.holds:
        most = run.accepted.iteration.summary.mass_g
    earlier = [
        each
        for each in run.iterations[:-1]
        if each.summary.number not in run.tried
        and each.summary.mass_g < most
        and is_ready(each, run.factors)
    ]
    if not (run.tried and earlier):
        return None
    if stages.why_ended(run.iterations[:-1], run.factors) is not None:
        return None  # no time for another one
    return min(earlier, key=lambda each: each.summary.mass_g)


def _judge(stages: Stages, run: _Run, design: DesignIteration) -> Ended | None:
    """Have a design judged and learn from it; the reason to end, if it gives one."""
    number = design.summary.number
    latest = _accept(stages, run, design)
    run.accepted = _better(run.accepted, latest)
    if latest.holds and is_tight(latest.rows, at_lower_bound=design.at_lower_bound):
        return _tight_end(run.accepted, latest)
    judged = Judged(holds=latest.holds, factors=dict(latest.factors))
    run.factors = _next_factors(run.last, judged, refused=bool(run.refused))
    run.last = judged
    if not latest.holds:
        run.refused = (*run.refused, number)
    stages.store_acceptance(run.refused, run.factors, judged)
    run.unjudged = run.unjudged + 1 if latest.unjudged else 0
    if run.unjudged == _MOST_UNJUDGED:
        return unjudged_end(latest.unjudged)
    return enclosed_by(run.accepted, run.iterations, run.refused, run.factors)


def _accept(stages: Stages, run: _Run, design: DesignIteration) -> Accepted:
    """Have a design judged, with its analysis if it is the last one; another one makes room.

    So does a refused design: the later one decides.
    """
    run.tried.add(design.summary.number)
    if run.accepted is not None and not run.accepted.holds:
        run.accepted = None
    analysed = run.analysed if design is run.iterations[-1] else None
    run.analysed = None
    return stages.accept(design, analysed)


def _iterate(stages: Stages, run: _Run) -> Ended | None:
    """Make another design, unless there is a reason to end."""
    ended = stages.why_ended(run.iterations, run.factors)
    if ended is not None:
        return ended
    run.analysed = None
    try:
        iteration, run.analysed = stages.iterate(run.iterations, run.factors)
    except (LatticeError, MeshError, ResourceError) as error:
        if not run.iterations:
            raise
        # What earlier iterations found is not lost with a design that cannot be analysed.
        return refused_end(run.iterations, error)
    run.iterations = (*run.iterations, iteration)
    if run.last is None:
        run.factors = iteration.expected
    stages.store_iteration(run.iterations)
    return enclosed_by(run.accepted, run.iterations, run.refused, run.factors)


def _next_factors(before: Judged | None, now: Judged, *, refused: bool) -> Factors:
    """Factors for the next design: where two designs enclose it, the means of both.

    After a first refused design its factors alone count: earlier ones were far from their limits.

    ``before``, ``now``: last two designs; ``refused``: whether a design was refused before this
    one.
    """
    if before is None or before.holds == now.holds or not refused:
        return now.factors
    return mean_factors(before.factors, now.factors)


def _tight_end(accepted: Accepted, latest: Accepted) -> Ended:
    """End because a design uses a limit, or because an earlier one is lighter without."""
    if accepted is latest:
        return TIGHT_END
    return heavier_end(accepted.iteration.summary.mass_g, latest.iteration.summary.mass_g)


def _better(earlier: Accepted | None, later: Accepted) -> Accepted:
    """The design that holds; of two, the lighter; of none and of equal ones, the later."""
    if earlier is None or not earlier.holds:
        return later
    if not later.holds:
        return earlier
    return min(later, earlier, key=lambda a: a.iteration.summary.mass_g)


def _teaches(iterations: Sequence[DesignIteration], factors: Factors, tried: set[int]) -> bool:
    """Whether a design holds and is near a limit, from the second on and before any acceptance.

    Its acceptance gives factors for all later designs, and an early verdict.
    """
    rows = with_factors(iterations[-1].rows, factors)
    near = worst_utilisation(rows) >= NEAR
    return not tried and len(iterations) > 1 and all_hold(rows) and near
