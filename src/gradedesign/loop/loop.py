"""The loop over designs: iterate until one is accepted, no iteration can help, or a budget ends.

It depends on no mesh, solver or file: the steps of an iteration are injected as `Stages`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from gradedesign.errors import LatticeError, MeshError, ResourceError
from gradedesign.limits.verdict import (
    Factors,
    all_hold,
    is_tight,
    mean_factors,
    with_factors,
    worst_utilisation,
)
from gradedesign.loop.accepted import Accepted
from gradedesign.loop.ended import TIGHT_END, Ended, heavier_end, refused_end, unjudged_end
from gradedesign.loop.iteration import Analysed, DesignIteration
from gradedesign.loop.left_designs import NEAR, enclosed_by, is_ready, judge_left
from gradedesign.loop.loop_stages import Judged, Stages

#: Designs in succession that could be analysed at one resolution only, after which no other is
#: tried: those of one case need much the same.
MOST_UNJUDGED = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """State of a run between iterations, with which a resumed run begins.

    Attributes
    ----------
    iterations : tuple of DesignIteration
        Finished, in order.
    refused : tuple of int
        Numbers of the iterations whose design acceptance refused.
    factors : mapping of a limit's key to float
        Accepted over explicit value.
    last : Judged, optional
        Design that was judged last.
    """

    iterations: tuple[DesignIteration, ...] = ()
    refused: tuple[int, ...] = ()
    factors: Factors = field(default_factory=dict)
    last: Judged | None = None

    @property
    def counting(self) -> Factors:
        """Factors of the last acceptance; before any, those that the last iteration expects."""
        if self.last is None and self.iterations:
            return self.iterations[-1].expected
        return self.factors


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Last state of the loop.

    Attributes
    ----------
    iterations : tuple of DesignIteration
    accepted : Accepted or None
        The lightest design that acceptance held, else the last that it refused; None if none came
        so far.
    ended : Ended
    """

    iterations: tuple[DesignIteration, ...]
    accepted: Accepted | None
    ended: Ended


def run_loop(stages: Stages, start: Progress | None = None) -> Outcome:
    """Iterate until a design is accepted, none can help, or iterations or time run out.

    Parameters
    ----------
    stages : Stages
    start : Progress, optional
        Of the run that is resumed.

    Raises
    ------
    LatticeError, MeshError, ResourceError
        If the first design cannot be built or analysed. A later one that cannot ends the loop.
    """
    start = Progress() if start is None else start
    iterations, refused = start.iterations, start.refused
    factors, last = start.counting, start.last
    tried, unjudged = set(refused), 0
    accepted: Accepted | None = None
    analysed: Analysed | None = None
    while True:
        if (
            iterations
            and iterations[-1].summary.number not in tried
            and (is_ready(iterations[-1], factors) or _teaches(iterations, factors, tried))
        ):
            tried.add(iterations[-1].summary.number)
            if accepted is not None and not accepted.holds:
                # The later one decides: the fields of the refused one make room.
                accepted = None
            latest = stages.accept(iterations[-1], analysed)
            accepted = _better(accepted, latest)
            if latest.holds and is_tight(latest.rows, at_lower_bound=iterations[-1].at_lower_bound):
                ended = tight_end(accepted, latest)
                break
            judged = Judged(holds=latest.holds, factors=dict(latest.factors))
            factors = next_factors(last, judged, refused=bool(refused))
            last = judged
            if not latest.holds:
                refused = (*refused, iterations[-1].summary.number)
            stages.store_acceptance(refused, factors, judged)
            unjudged = unjudged + 1 if latest.unjudged else 0
            if unjudged == MOST_UNJUDGED:
                ended = unjudged_end(latest.unjudged)
                break
            enclosed = enclosed_by(accepted, iterations, refused)
            if enclosed is not None:
                ended = enclosed
                break
            del latest
        analysed = None
        stop = stages.why_ended(iterations, factors)
        if stop is not None:
            ended = stop
            break
        try:
            iteration, analysed = stages.iterate(iterations, factors)
        except (LatticeError, MeshError, ResourceError) as error:
            if not iterations:
                raise
            # What earlier iterations found is not lost with a design that cannot be analysed.
            ended = refused_end(iterations, error)
            break
        iterations = (*iterations, iteration)
        if last is None:
            factors = iteration.expected
        stages.store_iteration(iterations)
    accepted, ended = judge_left(stages, iterations, factors, last, accepted, ended, tried)
    accepted = _judged_last(stages, iterations, refused, accepted)
    return Outcome(iterations=iterations, accepted=accepted, ended=ended)


def _judged_last(
    stages: Stages,
    iterations: Sequence[DesignIteration],
    refused: Sequence[int],
    accepted: Accepted | None,
) -> Accepted | None:
    """The design of the verdict with everything that judges it."""
    if accepted is None and refused:
        # Refused before this process: its rows are what decided.
        accepted = stages.accept(iterations[refused[-1] - 1], None)
    if accepted is not None and accepted.postponed:
        accepted = stages.judge_stress(accepted)
    return accepted


def next_factors(before: Judged | None, now: Judged, *, refused: bool) -> Factors:
    """Factors for the next design: where two designs enclose it, the means of both.

    After a first refused design its factors alone count: earlier ones were far from their limits.

    Parameters
    ----------
    before, now : Judged
        Last two designs.
    refused : bool
        Whether a design was refused before this one.
    """
    if before is None or before.holds == now.holds or not refused:
        return now.factors
    return mean_factors(before.factors, now.factors)


def tight_end(accepted: Accepted, latest: Accepted) -> Ended:
    """End at a design that uses a limit, or at an earlier one that is lighter and does not."""
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
