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
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.state import Response
from gradedesign.mechanics.sizing.convergence import (
    calmed,
    is_two_cycle,
    mass_settled,
    near_enough,
    rise,
    stands_still,
)
from gradedesign.mechanics.sizing.felt_variables import (
    FeltVariables,
    felt_variables,
    first_variables,
    variable_floor,
)
from gradedesign.mechanics.sizing.filter import collected
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.lattice_stiffness import growth_exponent
from gradedesign.mechanics.sizing.lowered import lowered
from gradedesign.mechanics.sizing.mean_density import size_by_mean_density
from gradedesign.mechanics.sizing.optimality import optimality_step
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    element_densities,
    filtered_for,
    sizing_result,
    sizing_step,
)
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import SolvedState, solved_state

log = logging.getLogger(__name__)

#: Iterations beyond the stated number, while a limit is used beyond its aim. Chosen, not measured.
INSISTENCE = 3
#: Designs before, from whose displacements the next solves start. They save a third of the
#: applications of multigrid in `bracket` (612 instead of 916).
RECENT = 2

__all__ = ["SizingProblem", "SizingResult", "SizingStep", "size"]


def size(
    problem: SizingProblem,
    *,
    start: FloatArray | None = None,
    max_iterations: int = 60,
    tolerance: float = 0.004,
    move: float = 0.3,
    keep: float = 0.0,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Minimise the mass of the lattice under its limits.

    Parameters
    ----------
    start : (n,) array, optional
        Design variables to begin from; the middle of the bounds by default.
    max_iterations : int
        Three times as many while a utilisation is above its aim.
    tolerance : float
        Converged when no density changes by more, relative to the upper bound, or mass and
        utilisations stand still, none farther above its aim; or when nothing moves at all.
        Whether the limits hold is `SizingResult.feasible`.
    move : float
        Largest relative change of a variable per iteration.
    keep : float
        Share of its start that every variable keeps at least.
    on_step : callable, optional

    Returns
    -------
    SizingResult

    Notes
    -----
    A filter of one column is a uniform density, see `size_by_mean_density`. Else limits by gradient
    enter by adjoints through an optimality criterion; the others enter as a lower bound of each
    density, as the stress ratio does (Ramirez 2022, A.2.3); the highest governs. Iterates that jump
    to and fro are recognised and damped by halving the move limit. Beyond ``max_iterations`` a
    limit that gains nothing raises all densities. A design that ends below its aim is lowered to
    it, see `lowered`.
    """
    if problem.filter.shape[1] == 1:
        return size_by_mean_density(
            problem, partial(np.full, problem.filter.shape[0]), problem.bounds,
            start=None if start is None else float(start[0]), max_iterations=max_iterations,
            tolerance=tolerance, on_step=on_step,
        )  # fmt: skip
    lo, hi = problem.bounds
    felt = felt_variables(problem)
    x = first_variables(problem, felt, start)
    history: list[SizingStep] = []
    previous: list[FloatArray] = []
    allowances = [1.0] * len(problem.limits)
    memories: list[tuple[int, ...]] = [()] * len(problem.limits)
    recent: deque[tuple[FloatArray, ...]] = deque(maxlen=RECENT)
    first, calm, least_variables = x, np.ones(x.shape), keep * x
    for iteration in range(INSISTENCE * max_iterations):
        rho = element_densities(problem, x)
        most = max_iterations * (1 if iteration < max_iterations else INSISTENCE)
        with stepping(f"sizing iteration {iteration + 1} of {most} at most"):
            analysed = _analyse(problem, rho, memories, recent)
        report_step(f"new densities of iteration {iteration + 1}")
        floor = _density_floor(problem, analysed, allowances)
        floor = np.maximum(variable_floor(problem.filter, felt.sums, floor, lo), least_variables)
        bounds = _step_bounds(x, move * calm, floor, (lo, hi))
        new = _new_variables(problem, felt, x, analysed, bounds)
        change = float(np.abs(new - x)[felt.active].max(initial=0.0) / hi)
        step = sizing_step(problem, rho, iteration, analysed.utilisations, change)
        history.append(step)
        if on_step is not None:
            on_step(step)
        holds = step.utilisation <= near_enough(problem, tolerance)
        settled = iteration > 2 and stands_still(history, tolerance, holds=holds)
        stalled = settled or mass_settled(history, tolerance)
        factor = 1.0 if holds else rise(history, problem.target, settled=stalled)
        ended = settled and factor == 1.0
        if ended or (holds and iteration + 1 >= max_iterations):
            least = np.where(felt.active, np.maximum(lo, keep * first), x)
            return _at_its_aim(problem, x, least, history, tolerance, on_step, converged=ended)
        if factor > 1.0 and (stalled or iteration + 1 >= max_iterations):
            new = least_variables = np.maximum(least_variables, np.minimum(factor * new, hi))
        if previous:
            calm = calmed(calm, (new - x) * (x - previous[-1]))
        if len(previous) > 1 and is_two_cycle(new, x, previous[-1]):
            move *= 0.5
        previous.append(x)
        x = new
    return sizing_result(problem, previous[-1], history, converged=False)


def _at_its_aim(
    problem: SizingProblem,
    x: FloatArray,
    least: FloatArray,
    history: Sequence[SizingStep],
    tolerance: float,
    on_step: Callable[[SizingStep], None] | None,
    *,
    converged: bool,
) -> SizingResult:
    """Result of variables that hold every limit, lowered where they stay below the aim."""
    accepted = near_enough(problem, tolerance)
    x, steps = lowered(problem, x, history[-1], least, accepted, on_step)
    return sizing_result(problem, x, [*history, *steps], converged=converged)


def _step_bounds(
    x: FloatArray, move: FloatArray, floor: FloatArray, bounds: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest variables of a step: within its move limits, but never below the floor."""
    lo, hi = bounds
    lower = np.clip(np.maximum(x * (1 - move), floor), lo, hi)
    return lower, np.maximum(np.clip(x * (1 + move), lo, hi), lower)


def _new_variables(
    problem: SizingProblem,
    felt: FeltVariables,
    x: FloatArray,
    analysed: _Analysed,
    bounds: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Lightest variables within the bounds of a step that hold the limits by gradient."""
    lower, upper = bounds
    active = felt.active
    if not any(limit.by_gradient for limit in problem.limits):
        return np.where(active, lower, problem.bounds[0])
    new = x.copy()
    new[active] = optimality_step(
        x[active],
        felt.cost[active],
        analysed.governing / problem.target,
        collected(problem.filter, analysed.gradients * felt.slope / problem.target)[:, active],
        lower[active],
        upper[active],
        exponent=_mean_exponent(problem.model, analysed.state.rho),
    )[0]
    return new


def _density_floor(
    problem: SizingProblem, analysed: _Analysed, allowances: list[float]
) -> FloatArray:
    """Least filtered variables ``(M,)`` that limits without gradient ask for; steers allowances."""
    floor = np.zeros(analysed.state.rho.shape)
    for k, (limit, used) in enumerate(zip(problem.limits, analysed.utilisations, strict=True)):
        if not limit.by_gradient:
            allowances[k] = _next_allowance(limit, allowances[k], problem.target, used)
            wanted = limit.least_density(analysed.state, allowances[k])
            floor = np.maximum(floor, wanted)
    return filtered_for(problem, floor)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Analysed:
    """One analysed design: every limit, and the governing values by gradient that are in reach.

    Attributes
    ----------
    utilisations : tuple of float
        Of every limit.
    governing : (k,) array
        Utilisations at the points that govern limits by gradient.
    gradients : (k, M) array
        Theirs by every density.
    """

    state: SolvedState
    utilisations: tuple[float, ...]
    governing: FloatArray
    gradients: FloatArray


def _analyse(
    problem: SizingProblem,
    rho: FloatArray,
    memories: list[tuple[int, ...]],
    recent: deque[tuple[FloatArray, ...]],
) -> _Analysed:
    """Solve a design for every limit and its gradient.

    ``memories`` are those of the limits from earlier designs, ``recent`` the displacements under
    loads and adjoint loads of the last of them; both are brought up to date.
    """
    model, limits = problem.model, problem.limits
    system = homogenised_system(model, rho, [u for design in recent for u in design])
    state = solved_state(model, rho, limits, system)
    utilisations = tuple(float(limit.predict(state).value) / limit.allowed for limit in limits)
    responses: list[Response] = []
    allowed: list[float] = []
    for k, limit in enumerate(limits):
        if limit.by_gradient:
            predicted, memories[k] = limit.responses(state, memories[k])
            responses += predicted
            allowed += [limit.allowed] * len(predicted)
    ratios = np.array([response.value for response in responses]) / np.array(allowed)
    reach = _in_reach(ratios)
    near = [response for response, chosen in zip(responses, reach, strict=True) if chosen]
    adjoints = solve_adjoints(model, system, near)
    gradients = response_gradients(state, near, adjoints) / np.array(allowed)[reach][:, None]
    recent.append(tuple(s.displacement for s in (*state.solutions.values(), *adjoints)))
    return _Analysed(
        state=state, utilisations=utilisations, governing=ratios[reach], gradients=gradients
    )


def _mean_exponent(model: HomogenisedModel, rho: FloatArray) -> float:
    """Mean of d(ln C11)/d(ln rho) over the lattice, the power of the reciprocal expansion."""
    weights = model.lattice_volumes
    return max(float(weights @ growth_exponent(model, rho) / weights.sum()), 1.0)


def _in_reach(utilisation: FloatArray) -> BoolArray:
    """Limits that one step can make active: used to a third of the most used one.

    Move limits of 30 % change a displacement by less than a factor of three.
    """
    return np.asarray(utilisation > utilisation.max(initial=0.0) / 3.0)


def _next_allowance(limit: Limit, allowance: float, target: float, utilisation: float) -> float:
    """Steer the bound of a limit at every point so that its value lands on its target."""
    if utilisation <= 0:
        return allowance
    return float(np.clip(allowance * np.sqrt(target / utilisation), 0.5, limit.most_allowance))
