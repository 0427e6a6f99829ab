"""The loop over designs: iterate until one is accepted, no iteration can help, or a budget ends.

It knows no mesh, no solver and no file: what is done with a design is injected as `Stages`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from gradedesign.errors import LatticeError, MeshError, ResourceError
from gradedesign.limits.verdict import Factors, all_hold, is_tight, with_factors
from gradedesign.loop.accepted import Accepted
from gradedesign.loop.ended import TIGHT_END, Ended, refused_end
from gradedesign.loop.rounds import Analysed, Round


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stages:
    """Stages of the loop, injected as functions.

    Attributes
    ----------
    iterate : callable
        Size with what earlier rounds and acceptance taught, analyse explicitly and correct:
        finished rounds and factors to the next round and its analysis.
    accept : callable
        A round, and its analysis where that is at hand, to what acceptance says of its design.
    why_ended : callable
        Finished rounds and factors to what ends the loop before another round, or None.
    store_round : callable
        Keeps the last of the finished rounds for a run that is resumed.
    store_acceptance : callable
        Keeps the rounds that were refused, and the factors.
    """

    iterate: Callable[[tuple[Round, ...], Factors], tuple[Round, Analysed]]
    accept: Callable[[Round, Analysed | None], Accepted]
    why_ended: Callable[[tuple[Round, ...], Factors], Ended | None]
    store_round: Callable[[tuple[Round, ...]], None]
    store_acceptance: Callable[[tuple[int, ...], Factors], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Progress:
    """State of a run between iterations, with which a resumed run begins.

    Attributes
    ----------
    rounds : tuple of Round
        Finished, in order.
    refused : tuple of int
        Numbers of the rounds whose design acceptance refused.
    factors : mapping of a limit's key to float
        Accepted over explicit value.
    """

    rounds: tuple[Round, ...] = ()
    refused: tuple[int, ...] = ()
    factors: Factors = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """Where the loop ended.

    Attributes
    ----------
    rounds : tuple of Round
    accepted : Accepted or None
        The lightest design that acceptance held, else the last that it refused; None if none came
        so far.
    ended : Ended
    """

    rounds: tuple[Round, ...]
    accepted: Accepted | None
    ended: Ended


def run_loop(stages: Stages, start: Progress | None = None) -> Outcome:
    """Iterate until a design is accepted, no iteration can help, or rounds or time run out.

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
    rounds, refused, factors = start.rounds, start.refused, start.factors
    tried = set(refused)
    accepted: Accepted | None = None
    analysed: Analysed | None = None
    while True:
        if rounds and rounds[-1].iteration.number not in tried and _is_ready(rounds[-1], factors):
            tried.add(rounds[-1].iteration.number)
            latest = stages.accept(rounds[-1], analysed)
            accepted = _better(accepted, latest)
            if latest.holds and is_tight(latest.rows, at_lower_bound=rounds[-1].at_lower_bound):
                ended = TIGHT_END
                break
            factors = latest.factors
            if not latest.holds:
                refused = (*refused, rounds[-1].iteration.number)
            stages.store_acceptance(refused, factors)
        stop = stages.why_ended(rounds, factors)
        if stop is not None:
            ended = stop
            break
        try:
            done, analysed = stages.iterate(rounds, factors)
        except (LatticeError, MeshError, ResourceError) as error:
            if not rounds:
                raise
            # What earlier rounds found is not lost with a design that cannot be analysed.
            ended = refused_end(rounds, error)
            break
        rounds = (*rounds, done)
        stages.store_round(rounds)
    if accepted is None or not accepted.holds:
        accepted = _best_left(stages, rounds, factors, tried) or accepted
    if accepted is None and refused:
        # Refused before this process: its rows are what decided.
        accepted = stages.accept(rounds[refused[-1] - 1], None)
    return Outcome(rounds=rounds, accepted=accepted, ended=ended)


def _best_left(
    stages: Stages, rounds: Sequence[Round], factors: Factors, tried: set[int]
) -> Accepted | None:
    """Accept the lightest earlier design that held every limit, if there is one left."""
    left = [
        r
        for r in rounds
        if r.iteration.number not in tried and all_hold(with_factors(r.rows, factors))
    ]
    for done in sorted(left, key=lambda r: r.iteration.mass_g):
        accepted = stages.accept(done, None)
        if accepted.holds:
            return accepted
    return None


def _better(earlier: Accepted | None, later: Accepted) -> Accepted:
    """The design that holds; of two, the lighter; of none, the later."""
    if earlier is None or not earlier.holds:
        return later
    if not later.holds:
        return earlier
    return min(earlier, later, key=lambda a: a.round.iteration.mass_g)


def _is_ready(done: Round, factors: Factors) -> bool:
    """Limits hold in the explicit analysis, with what acceptance taught, and one is used."""
    rows = with_factors(done.rows, factors)
    return all_hold(rows) and is_tight(rows, at_lower_bound=done.at_lower_bound)
