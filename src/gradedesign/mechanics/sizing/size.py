"""Sizing: the lightest density field that meets every limit on the homogenised part."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.sizing.analysed_design import Recent, solved_design
from gradedesign.mechanics.sizing.filter import collected
from gradedesign.mechanics.sizing.mean_density import size_by_mean_density
from gradedesign.mechanics.sizing.members import at_points
from gradedesign.mechanics.sizing.moving_asymptotes import first_asymptotes, moved_asymptotes
from gradedesign.mechanics.sizing.next_design import approximated, next_design
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    density_slope,
    sizing_result,
    sizing_step,
    variable_bounds,
)

log = logging.getLogger(__name__)

#: Times the stated number of iterations, while a limit is used beyond its aim, unless the caller
#: states another. Chosen, not measured.
INSISTENCE = 3
#: Share of the aim by which a design that is settled may be off. Chosen, not measured.
TOLERANCE = 0.004
#: Designs before, from whose displacements the next solves start. They save a third of the
#: applications of multigrid in `bracket` (612 instead of 916).
_RECENT = 2
#: Iterations over which mass and utilisations stand still where a design has settled. Chosen, not
#: measured.
_STILL = 4
#: A most used limit that stands below the aim by more than this share is worth more iterations.
#: Chosen, not measured.
_SPARE = 0.005
#: Share of the mass by which an iteration must make a design lighter to be followed by more than
#: asked for: members of `cantilever-compact` weighed 84 instead of 53 g where their rough stages
#: ended as soon as they held.
_FALL = 0.01
#: Sharpness of the step of members beyond which variables move less, in proportion: with full moves
#: at 32 and 64 the limits of `bracket` were passed by half and by more in turn.
_SHARP = 8.0
#: Changes below this share of the tolerance are none. Chosen, not measured.
_UNMOVED = 0.05

__all__ = ["SizingProblem", "SizingResult", "SizingStep", "size"]


def size(
    problem: SizingProblem,
    *,
    start: FloatArray | None = None,
    max_iterations: int = 60,
    insistence: int = INSISTENCE,
    tolerance: float = TOLERANCE,
    move: float = 0.3,
    keep: float = 0.0,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Minimise the mass of the lattice under its limits.

    - ``start (n,)``: design variables to begin from; the middle of the bounds by default
    - ``max_iterations``: ``insistence`` times as many while a utilisation is above its aim, all are
      well below it, or the mass still falls
    - ``tolerance``: converged when no density changes by more, relative to the upper bound, or mass
      and utilisations stand still, none farther above its aim; or when nothing moves at all.
      Whether the limits hold is `SizingResult.feasible`.
    - ``move``: largest change of the logarithm of a variable per iteration; less of sharp members
    - ``keep``: share of its start that every variable keeps at least

    Notes
    -----
    A filter of one column is a uniform density, see `size_by_mean_density`. Else all limits enter
    together by their gradients, as logarithms of utilisations, which stay of order 1, through the
    method of moving asymptotes.
    """
    if problem.filter.shape[1] == 1:
        return size_by_mean_density(
            problem, partial(np.full, problem.filter.shape[0]), problem.bounds,
            start=None if start is None else float(start[0]), max_iterations=max_iterations,
            tolerance=tolerance, on_step=on_step,
        )  # fmt: skip
    if problem.members is not None:
        move *= _SHARP / max(problem.members.sharpness, _SHARP)
    ends = variable_bounds(problem)
    lo, hi = ends
    active = _moving_variables(problem)
    x = np.sqrt(lo * hi) if start is None else start
    x = np.where(active, np.clip(x, lo, hi), lo)
    least = np.maximum(keep * x, lo)
    top = np.where(active, hi, least)
    asymptotes = first_asymptotes(x, *ends)
    history: list[SizingStep] = []
    recent: Recent = deque(maxlen=_RECENT)
    change, curvature = 1.0, np.ones(len(problem.limits))
    most, last = max_iterations, insistence * max_iterations
    with stepping(f"sizing iteration 1 of {most} at most"):
        design = solved_design(problem, x, recent)
    for iteration in range(last):
        history.append(
            sizing_step(
                problem, design.state.rho, iteration, design.utilisations, change,
                design.state.share,
            )
        )  # fmt: skip
        if on_step is not None:
            on_step(history[-1])
        ended = _stands_still(problem, history, tolerance)
        if ended or iteration + 1 == last or _is_enough(problem, history, most, tolerance):
            break
        within = most if iteration + 2 <= most else last
        with stepping(f"sizing iteration {iteration + 2} of {within} at most"):
            near = approximated(problem, design, x, recent)
            del design
            new, design, curvature = next_design(  # noqa: RUF059 - read by the next iteration
                problem, near, asymptotes.distance, (least, top), move, curvature, recent
            )
        asymptotes = moved_asymptotes(asymptotes, new, *ends)
        change = float((np.abs(new - x) / hi).max(initial=0.0))
        x = new
    return sizing_result(problem, x, history, converged=ended)


def _moving_variables(problem: SizingProblem) -> BoolArray:
    """Design variables that move any lattice, ``(n,)``."""
    room = problem.model.lattice_volumes
    moves = collected(problem.filter, room * density_slope(problem)) > 0
    if problem.members is None:
        return np.asarray(moves)
    allowed = problem.members.allowed
    room = at_points(room) * (1.0 if allowed is None else allowed)
    return np.concatenate([moves, collected(problem.members.filter, room) > 0])


def _holds(problem: SizingProblem, step: SizingStep, tolerance: float) -> bool:
    """Whether a stationary design is accepted: near the aim, within limits."""
    near = problem.target * (1 + tolerance)
    return step.utilisation <= (near if problem.target >= 1.0 else min(near, 1.0))


def _is_enough(
    problem: SizingProblem, history: Sequence[SizingStep], most: int, tolerance: float
) -> bool:
    """All iterations are made; limits hold, none is far below the aim, and mass hardly falls."""
    last, before = history[-1], history[-2:][0]
    spare = last.utilisation < (1 - max(_SPARE, tolerance)) * problem.target
    falls = last.mass_g < (1 - _FALL) * before.mass_g
    return len(history) >= most and _holds(problem, last, tolerance) and not (spare or falls)


def _stands_still(problem: SizingProblem, history: Sequence[SizingStep], tolerance: float) -> bool:
    """Mass and utilisations have settled where the limits hold, or nothing moves at all."""
    last = history[-_STILL:]
    if len(history) <= _STILL:
        return False
    mass = np.array([step.mass_g for step in last])
    used = np.array([step.utilisations for step in last])
    settled = bool(
        np.ptp(mass) <= tolerance * mass[-1] and np.ptp(used, axis=0).max(initial=0.0) <= tolerance
    )
    holds = _holds(problem, last[-1], tolerance)
    return (holds and settled) or all(step.change < _UNMOVED * tolerance for step in last)
