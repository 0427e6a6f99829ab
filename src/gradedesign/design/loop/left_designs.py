"""Designs that the loop has analysed but not judged: which of them to judge when it ends."""

from __future__ import annotations

from collections.abc import Sequence

from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.loop.ended import TIGHT_END, Ended, enclosed_end
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.loop_stages import Judged, Stages
from gradedesign.mechanics.limits.verdict import (
    TIGHT,
    Factors,
    all_hold,
    is_tight,
    with_factors,
    worst_utilisation,
)

#: Least utilisation of a limit at which acceptance of a design corrects the next one. Chosen, not
#: measured.
NEAR = 0.88
#: A design with this expected utilisation may hold: factors of two acceptances differ by 1 to 3 %.
_MAY_HOLD = 1.02


def judge_left(
    stages: Stages,
    iterations: tuple[DesignIteration, ...],
    factors: Factors,
    last: Judged | None,
    held: Accepted | None,
    ended: Ended,
    tried: set[int],
) -> tuple[Accepted | None, Ended]:
    """Judge designs that the loop has not judged but that may hold or be lighter.

    Returns ``accepted``: the lightest design that holds, else the last one that was refused here;
    None if nothing holds and nothing was judged here.

    - ``factors``: accepted over explicit values, by the last acceptance
    - ``last``: design that was judged last
    - ``held``: the design that acceptance held
    - ``tried``: numbers of the iterations that were judged, which ``stages.accept`` completes
    """
    if held is not None:
        if ended.by == "iterations" and last is not None:
            return _lighter_left(stages, iterations, last, held, ended, tried)
        return held, ended
    found = None
    if ended.by != "unjudged":
        found = _best_left(stages, iterations, factors, tried)
    if ended.by == "iterations" and (found is None or not found.holds):
        nearest = _nearest_left(iterations, factors, tried)
        # Nothing is judged where there is no time for another iteration.
        if nearest is not None and stages.why_ended(iterations[:-1], factors) is None:
            found = None
            found = stages.accept(nearest, None)
    return found, ended


def enclosed_by(
    accepted: Accepted | None,
    iterations: Sequence[DesignIteration],
    refused: Sequence[int],
    factors: Factors,
) -> Ended | None:
    """The end where the accepted design holds and a hardly lighter one does not, or None.

    That one was refused, or it came later, with what acceptance taught, and its explicit values
    times ``factors`` break a limit by more than factors differ: earlier ones may be heavier than
    they need be. A design far from all its limits is not the lightest because another one failed.
    """
    if accepted is None or not _may_be_lightest(accepted):
        return None
    masses = [
        each.summary.mass_g
        for each in iterations
        if each.summary.number in refused
        or (
            each.summary.number > accepted.iteration.summary.number
            and worst_utilisation(with_factors(each.rows, factors)) > _MAY_HOLD
        )
    ]
    return enclosed_end(accepted.iteration.summary.mass_g, masses)


def decides(iteration: DesignIteration, accepted: Accepted | None, factors: Factors) -> bool:
    """Whether acceptance of a design ends the loop, held or refused.

    It may hold and then uses a limit, and it is hardly lighter than the design that was accepted.
    """
    if accepted is None or not _may_be_lightest(accepted):
        return False
    used = worst_utilisation(with_factors(iteration.rows, factors))
    mass = accepted.iteration.summary.mass_g
    return TIGHT <= used <= _MAY_HOLD and enclosed_end(mass, [iteration.summary.mass_g]) is not None


def _may_be_lightest(accepted: Accepted) -> bool:
    """Whether a design holds and is near a limit, so that it may be the lightest."""
    return accepted.holds and worst_utilisation(accepted.rows) >= NEAR


def is_ready(iteration: DesignIteration, factors: Factors) -> bool:
    """Whether explicit values times the factors of acceptance hold, and use up a limit."""
    rows = with_factors(iteration.rows, factors)
    return all_hold(rows) and is_tight(rows, at_lower_bound=iteration.at_lower_bound)


def _best_left(
    stages: Stages, iterations: Sequence[DesignIteration], factors: Factors, tried: set[int]
) -> Accepted | None:
    """Judge the earlier designs that are expected to hold, the lightest first, until one does.

    That one is returned, or the last that is refused; None where no design is expected to hold.
    """
    candidates = [
        i
        for i in iterations
        if i.summary.number not in tried and all_hold(with_factors(i.rows, factors))
    ]
    accepted = None
    for iteration in sorted(candidates, key=lambda i: i.summary.mass_g):
        accepted = None  # the fields of a refused design make room
        accepted = stages.accept(iteration, None)
        if accepted.holds:
            break
    return accepted


def _nearest_left(
    iterations: tuple[DesignIteration, ...], factors: Factors, tried: set[int]
) -> DesignIteration | None:
    """The earlier design that by its factors breaks a limit least, if it may hold."""
    used = {
        worst_utilisation(with_factors(i.rows, factors)): i
        for i in iterations
        if i.summary.number not in tried
    }
    return used[min(used)] if used and min(used) <= _MAY_HOLD else None


def _lighter_left(
    stages: Stages,
    iterations: tuple[DesignIteration, ...],
    last: Judged,
    accepted: Accepted,
    ended: Ended,
    tried: set[int],
) -> tuple[Accepted, Ended]:
    """Judge the lightest earlier design that uses a limit by the latest factors, if any.

    The factors of two acceptances differ by some per cent where walls meet faces: a design that the
    first ones broke may hold. Either it is accepted, or it shows that the accepted one is the
    lightest. Nothing is judged where there is no time for another iteration.
    """
    mass = accepted.iteration.summary.mass_g
    candidates = [
        i
        for i in iterations
        if i.summary.number not in tried and i.summary.mass_g < mass and is_ready(i, last.factors)
    ]
    if not candidates or stages.why_ended(iterations[:-1], last.factors) is not None:
        return accepted, ended
    latest = stages.accept(min(candidates, key=lambda i: i.summary.mass_g), None)
    if not latest.holds:
        number = latest.iteration.summary.number
        return accepted, enclosed_by(accepted, iterations, (number,), last.factors) or ended
    tight = is_tight(latest.rows, at_lower_bound=latest.iteration.at_lower_bound)
    return latest, TIGHT_END if tight else ended
