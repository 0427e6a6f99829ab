"""The stages of the loop over designs, injected as functions, and what they answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gradedesign.design.loop.accepted import Accepted
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.ended import Ended
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.mechanics.limits.verdict import Factors


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """Outcome of an acceptance: whether the design holds; accepted over explicit values."""

    holds: bool
    factors: Factors


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stages:
    """Stages of the loop, injected as functions."""

    #: Finished iterations and factors to the next iteration and its analysis: size with the
    #: corrections so far, analyse explicitly and update the corrections.
    iterate: Callable[[tuple[DesignIteration, ...], Factors], tuple[DesignIteration, Analysed]]
    #: An iteration, and its analysis where that is at hand, to the acceptance of its design.
    accept: Callable[[DesignIteration, Analysed | None], Accepted]
    #: An accepted design whose submodels were postponed to the same design judged by them.
    judge_stress: Callable[[Accepted], Accepted]
    #: Finished iterations and factors to the reason to end before another iteration, or None.
    why_ended: Callable[[tuple[DesignIteration, ...], Factors], Ended | None]
    #: Keeps the last of the finished iterations for a run that is resumed.
    store_iteration: Callable[[tuple[DesignIteration, ...]], None]
    #: Keeps the iterations that were refused, the factors, and the last verdict.
    store_acceptance: Callable[[tuple[int, ...], Factors, Judged], None]
