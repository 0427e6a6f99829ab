"""Sizing: the lightest density field that meets every limit on the homogenised part."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import report_step, stepping
from gradedesign.mechanics.limits.state import Response
from gradedesign.mechanics.sizing.filter import collected, filtered
from gradedesign.mechanics.sizing.homogenised import homogenised_system, solid_held, solid_slope
from gradedesign.mechanics.sizing.mean_density import size_by_mean_density
from gradedesign.mechanics.sizing.members import (
    HALF,
    at_points,
    mean_share,
    member_price,
    step_slope,
    stepped,
    with_members,
)
from gradedesign.mechanics.sizing.moving_asymptotes import (
    Asymptotes,
    asymptotes_step,
    first_asymptotes,
    moved_asymptotes,
)
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    density_slope,
    designed_mass,
    element_densities,
    element_shares,
    member_variables,
    sizing_result,
    sizing_step,
    variable_bounds,
)
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import SolvedState, mode_shapes, solved_state

log = logging.getLogger(__name__)

#: Times the stated number of iterations, while a limit is used beyond its aim, unless the caller
#: states another. Chosen, not measured.
INSISTENCE = 3
#: Designs before, from whose displacements the next solves start. They save a third of the
#: applications of multigrid in `bracket` (612 instead of 916).
_RECENT = 2
#: Residuals of the loads' and of the adjoint solves, over their loads: `bracket` passes the same
#: designs with 1e-4 and 1e-2, with members among cells and alone, since iterations start from the
#: designs before and what is left moves no limit.
_RTOL, _ADJOINT_RTOL = 1e-2, 1e-1
#: The same where modes are limits: the stress of the loads is the stiffness of load factors, and
#: with the residuals above the strongest column comes out 3 % off Keller's in places.
_MODES_RTOL, _MODES_ADJOINT_RTOL = 1e-4, 1e-2
#: Iterations over which mass and utilisations stand still where a design has settled. Chosen, not
#: measured.
_STILL = 4
#: A most used limit that stands below the aim by more than this share is worth more iterations.
#: Chosen, not measured.
_SPARE = 0.005
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
    tolerance: float = 0.004,
    move: float = 0.3,
    keep: float = 0.0,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Minimise the mass of the lattice under its limits.

    - ``start (n,)``: design variables to begin from; the middle of the bounds by default
    - ``max_iterations``: ``insistence`` times as many while a utilisation is above its aim, or all
      are well below it
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
    asymptotes = first_asymptotes(x, *ends)
    history: list[SizingStep] = []
    recent: deque[tuple[FloatArray, ...]] = deque(maxlen=_RECENT)
    change = 1.0
    for iteration in range(insistence * max_iterations):
        rho, share = element_densities(problem, x), element_shares(problem, x)
        most = max_iterations * (1 if iteration < max_iterations else insistence)
        with stepping(f"sizing iteration {iteration + 1} of {most} at most"):
            analysed = _analyse(problem, rho, share, recent)
        used = analysed.utilisations
        history.append(sizing_step(problem, rho, iteration, used, change, share))
        if on_step is not None:
            on_step(history[-1])
        holds = history[-1].utilisation <= _near_enough(problem, tolerance)
        ended = _stands_still(history, tolerance, holds=holds)
        spare = history[-1].utilisation < (1 - _SPARE) * problem.target
        if ended or (iteration + 1 >= max_iterations and holds and not spare):
            return sizing_result(problem, x, history, converged=ended)
        report_step(f"new densities of iteration {iteration + 1}")
        new = x.copy()
        new[active] = _next_variables(problem, analysed, x, asymptotes, least, move)[active]
        asymptotes = moved_asymptotes(asymptotes, new, *ends)
        change = float((np.abs(new - x) / hi).max(initial=0.0))
        x = new
    return sizing_result(problem, x, history, converged=False)


def _moving_variables(problem: SizingProblem) -> BoolArray:
    """Design variables that move any lattice, ``(n,)``."""
    room = problem.model.lattice_volumes
    moves = collected(problem.filter, room * density_slope(problem)) > 0
    if problem.members is None:
        return np.asarray(moves)
    allowed = problem.members.allowed
    room = at_points(room) * (1.0 if allowed is None else allowed)
    return np.concatenate([moves, collected(problem.members.filter, room) > 0])


def _near_enough(problem: SizingProblem, tolerance: float) -> float:
    """Largest utilisation of a stationary design that is accepted: near the aim, within limits."""
    near = problem.target * (1 + tolerance)
    return near if problem.target >= 1.0 else min(near, 1.0)


def _stands_still(history: Sequence[SizingStep], tolerance: float, *, holds: bool) -> bool:
    """Mass and utilisations have settled where the limits hold, or nothing moves at all."""
    last = history[-_STILL:]
    if len(history) <= _STILL:
        return False
    mass = np.array([step.mass_g for step in last])
    used = np.array([step.utilisations for step in last])
    settled = bool(
        np.ptp(mass) <= tolerance * mass[-1] and np.ptp(used, axis=0).max(initial=0.0) <= tolerance
    )
    return (holds and settled) or all(step.change < _UNMOVED * tolerance for step in last)


def _next_variables(
    problem: SizingProblem,
    analysed: _Analysed,
    x: FloatArray,
    asymptotes: Asymptotes,
    least: FloatArray,
    move: float,
) -> FloatArray:
    """Lightest variables ``(n,)`` near the present ones that hold the limits, as approximated."""
    used = analysed.governing / problem.target
    with np.errstate(divide="ignore"):
        values = np.log(used)
    gradients = analysed.gradients / (problem.target * used[:, None])
    upper = variable_bounds(problem)[1]
    carrying = HALF if problem.members is None else problem.members.threshold
    free = least < upper
    new = least.copy()
    new[free], _ = asymptotes_step(
        x[free],
        _cost(problem, x, analysed.state)[free],
        values,
        _by_variables(problem, x, gradients, carrying)[:, free],
        (least[free], upper[free]),
        asymptotes.distance[free],
        move=move,
    )
    return new


def _cost(problem: SizingProblem, x: FloatArray, state: SolvedState) -> FloatArray:
    """Derivatives ``(n,)`` of the mass by every variable, over the mass.

    Shares of members between 0 and 1 cost their price.
    """
    model, rho, members = problem.model, state.rho, problem.members
    room, slope = model.lattice_volumes, solid_slope(model, rho)
    over = model.material.density / designed_mass(model, rho, state.share)
    if members is None:
        return _by_variables(problem, x, room * slope * over)
    weighed = stepped(members, filtered(members.filter, member_variables(problem, x)))
    price, by_share = member_price(members, weighed)
    by_density = room * (1 - mean_share(price)) * slope
    by_mean = at_points(room * (1 - solid_held(model, rho)))
    return _by_variables(problem, x, np.concatenate([by_density, by_mean * by_share]) * over)


def _by_variables(
    problem: SizingProblem, x: FloatArray, by_design: FloatArray, threshold: float = HALF
) -> FloatArray:
    """Derivatives ``(..., n)`` by variables of those by every variable of the design, (..., P).

    ``threshold``: of the step from which shares of members follow.
    """
    count, members = problem.filter.shape[0], problem.members
    by_x = collected(problem.filter, by_design[..., :count] * density_slope(problem))
    if members is None:
        return by_x
    field = filtered(members.filter, member_variables(problem, x))
    slope = step_slope(members, field, threshold)
    by_b = collected(members.filter, by_design[..., count:] * slope)
    return np.concatenate([by_x, by_b], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Analysed:
    """One analysed design: every limit, and the governing values that are in reach."""

    state: SolvedState
    utilisations: tuple[float, ...]  #: Of every limit.
    governing: FloatArray  #: ``(k,)``. Utilisations at the points that govern limits.
    gradients: FloatArray  #: ``(k, P)``. Theirs by every variable of the design.


def _analyse(
    problem: SizingProblem,
    rho: FloatArray,
    share: FloatArray | None,
    recent: deque[tuple[FloatArray, ...]],
) -> _Analysed:
    """Solve a design for every limit and its gradient.

    ``recent`` are the displacements under loads and adjoint loads of the last designs, and is
    brought up to date.
    """
    model, limits = with_members(problem.model, share), problem.limits
    modes = any(limit.mode() is not None for limit in limits)
    rtol, adjoint_rtol = (_MODES_RTOL, _MODES_ADJOINT_RTOL) if modes else (_RTOL, _ADJOINT_RTOL)
    system = homogenised_system(model, rho, [u for design in recent for u in design])
    state = solved_state(
        model, rho, limits, system, share=share, lattice_alone=problem.model, rtol=rtol
    )
    utilisations = tuple(limit.utilisation(float(limit.predict(state).value)) for limit in limits)
    responses: list[Response] = []
    used: list[float] = []
    slopes: list[float] = []
    # No value of a limit is used more than its prediction: those out of reach need no derivative.
    for limit, chosen in zip(limits, _in_reach(np.array(utilisations)), strict=True):
        if chosen:
            predicted = limit.responses(state)
            responses += predicted
            used += [limit.utilisation(response.value) for response in predicted]
            slopes += [limit.utilisation_slope(response.value) for response in predicted]
    ratios = np.array(used)
    reach = _in_reach(ratios)
    near = [response for response, chosen in zip(responses, reach, strict=True) if chosen]
    adjoints = solve_adjoints(model, system, near, rtol=adjoint_rtol)
    gradients = response_gradients(state, near, adjoints) * np.array(slopes)[reach][:, None]
    known = [adjoint for adjoint in adjoints if adjoint is not None]
    recent.append((*state.displacements.values(), *known, *mode_shapes(state)))
    return _Analysed(
        state=state, utilisations=utilisations, governing=ratios[reach], gradients=gradients
    )


def _in_reach(utilisation: FloatArray) -> BoolArray:
    """Limits that one step can make active: used to a third of the most used one.

    Move limits of 30 % change a displacement by less than a factor of three.
    """
    return np.asarray(utilisation > utilisation.max(initial=0.0) / 3.0)
