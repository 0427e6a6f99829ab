"""Sizing: the lightest density field that meets every limit on the homogenised part."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.sizing.buckling_limit import buckling_use, density_for_buckling
from gradedesign.sizing.governing_points import (
    GoverningPoints,
    no_points,
    point_limits,
    remember_points,
)
from gradedesign.sizing.homogenised import (
    homogenised_system,
    lattice_mass,
    solid_slope,
    solve_homogenised,
    solve_vectors,
)
from gradedesign.sizing.homogenised_model import HomogenisedModel
from gradedesign.sizing.lattice_stiffness import growth_exponent
from gradedesign.sizing.lattice_stress import LatticeStress, lattice_stress
from gradedesign.sizing.optimality import optimality_step
from gradedesign.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    sizing_result,
)
from gradedesign.sizing.responses import (
    adjoint_loads,
    displacement_gradient,
    displacement_values,
    stiffness_derivative,
)
from gradedesign.sizing.stress_limit import density_for_stress, stress_use
from gradedesign.sizing.uniform import size_uniform
from gradedesign.workspace.progress import report_step, stepping

log = logging.getLogger(__name__)

#: The move limit of a variable whose steps alternate shrinks by one factor, down to a share of the
#: common one, and grows by the other while they do not.
CALMER, BOLDER, LEAST_CALM = 0.7, 1.2, 0.1
#: Iterations over those asked for, while a limit is used beyond its aim.
INSISTENCE = 3
#: Changes below this share of the tolerance are none.
STILL = 0.05


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
    """Minimise the mass of the lattice under displacement, stress and buckling limits.

    Parameters
    ----------
    problem : SizingProblem
    start : (n,) array, optional
        Design variables to begin from; the middle of the bounds by default.
    max_iterations : int
        Three times as many while a use is above its aim.
    tolerance : float
        Converged when no density changes by more, relative to the upper bound, or mass and uses
        stand still, and no use is farther above its aim; or when nothing moves at all, as where
        bounds keep a limit from being met. Whether the limits hold is `SizingResult.feasible`.
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
    A filter of one column is a uniform density, see `size_uniform`. Else displacements enter by
    adjoints through an optimality criterion; the stress limit enters as a lower bound of each
    density, the stress ratio (Ramirez 2022, A.2.3), and so does buckling; the higher of the two
    governs. Iterates that jump to and fro are recognised and damped by halving the move limit.
    """
    if problem.filter.shape[1] == 1:
        return size_uniform(
            problem,
            start=None if start is None else float(start[0]),
            max_iterations=max_iterations,
            tolerance=tolerance,
            on_step=on_step,
        )
    lo, hi = problem.bounds
    model = problem.model
    weights = model.lattice_volumes
    # Mass per asked density: at the middle of the bounds, where cells at faces hold more or less.
    per_asked = solid_slope(model, np.full(weights.shape, np.sqrt(lo * hi)))
    cost = np.asarray(problem.filter.T @ (weights * per_asked)).ravel()
    active = cost > 0
    felt = problem.filter if active.all() else problem.filter[:, active]
    sums = np.asarray(problem.filter.sum(axis=0)).ravel()
    # Variables that no lattice feels stay at the lower bound.
    x = np.full(problem.filter.shape[1], np.sqrt(lo * hi)) if start is None else start.copy()
    x = np.where(active, np.clip(x, lo, hi), lo)
    history: list[SizingStep] = []
    previous: list[FloatArray] = []
    floor = np.full(model.volumes.shape, lo)
    allowance, room = 1.0, 1.0
    places = no_points(len(problem.displacement_limits))
    calm = np.ones(x.shape)
    kept = keep * x
    for iteration in range(INSISTENCE * max_iterations):
        rho = np.asarray(problem.filter @ x).ravel()
        with stepping(f"sizing iteration {iteration + 1} of {max_iterations} at most"):
            use, pointwise, stress, places = _evaluate(problem, rho, places)
        report_step(f"new densities of iteration {iteration + 1}")
        worst = stress_use(problem.stress_limit, model, rho, stress)
        if problem.stress_limit is not None:
            allowance = _next_allowance(allowance, problem.target, worst)
            wanted = density_for_stress(problem.stress_limit, model, stress, allowance=allowance)
            floor = np.clip(wanted, lo, hi)
        buckled = 0.0
        if problem.buckling_limit is not None:
            buckled = buckling_use(problem.buckling_limit, model, rho, stress).value
            # The most used cell must hold: none may exceed the limit as a percentile allows.
            room = min(_next_allowance(room, problem.target, buckled), 1.0)
            thin = density_for_buckling(problem.buckling_limit, model, stress, allowance=room)
            least = floor if problem.stress_limit is not None else lo
            floor = np.maximum(least, np.clip(thin, lo, hi))
        reach = move * calm
        step_lower = np.maximum(x * (1 - reach), _variable_floor(problem.filter, sums, floor, lo))
        step_lower = np.clip(np.maximum(step_lower, kept), lo, hi)
        step_upper = np.maximum(np.clip(x * (1 + reach), lo, hi), step_lower)
        new = x
        if len(use):
            new = x.copy()
            new[active] = optimality_step(
                x[active],
                cost[active],
                pointwise.use / problem.target,
                (pointwise.gradients / problem.target) @ felt,
                step_lower[active],
                step_upper[active],
                exponent=_mean_exponent(model, rho, weights),
            )[0]
        else:
            new = np.where(active, step_lower, lo)
        change = float(np.abs(new - x)[active].max() / hi) if active.any() else 0.0
        step = SizingStep(
            iteration=iteration,
            mass_g=lattice_mass(model, rho) * 1e6,
            mean_density=float(weights @ rho / weights.sum()),
            displacement_use=tuple(float(v) for v in use),
            stress_use=worst,
            change=change,
            move=move,
            buckling_use=buckled,
        )
        history.append(step)
        if on_step is not None:
            on_step(step)
        settled = change < tolerance or _mass_settled(history, tolerance)
        still = change < STILL * tolerance
        holds = step.use <= _near_enough(problem, tolerance)
        if iteration > 2 and (still or (settled and holds)):
            return sizing_result(problem, x, history, converged=True)
        if holds and iteration + 1 >= max_iterations:
            break
        if previous:
            calm = _calmed(calm, (new - x) * (x - previous[-1]))
        if len(previous) > 1 and _is_two_cycle(new, x, previous[-1]):
            move *= 0.5
        previous.append(x)
        x = new
    return sizing_result(problem, x, history, converged=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pointwise:
    """Uses ``(k,)`` and gradients ``(k, M)`` of limits at the points that govern them."""

    use: FloatArray
    gradients: FloatArray


def _evaluate(
    problem: SizingProblem, rho: FloatArray, places: GoverningPoints
) -> tuple[FloatArray, _Pointwise, tuple[LatticeStress, ...], GoverningPoints]:
    """Use of every displacement limit, what governs those in reach, stress per load case."""
    model, limits = problem.model, problem.displacement_limits
    system = homogenised_system(model, rho)
    solutions = solve_homogenised(model, rho, system)
    count = len(rho)
    judged = problem.stress_limit is not None or problem.buckling_limit is not None
    stress = lattice_stress(model, rho, solutions) if judged else ()
    if not limits:
        nothing = _Pointwise(use=np.zeros(0), gradients=np.zeros((0, count)))
        return np.zeros(0), nothing, stress, places
    values = displacement_values(limits, solutions)
    use = values / np.array([limit.limit for limit in limits])
    places = remember_points(places, limits, solutions, model.space.nodes)
    every = point_limits(places, limits)
    held = displacement_values(every, solutions) / np.array([limit.limit for limit in every])
    reach = _in_reach(held)
    near = [limit for limit, chosen in zip(every, reach, strict=True) if chosen]
    adjoints = solve_vectors(system, adjoint_loads(model, near, solutions))
    cases = {case.name: case for case in model.cases}
    by_name = {s.name: s for s in solutions}
    derivative = stiffness_derivative(model, rho)
    gradients = np.array(
        [
            displacement_gradient(
                model, rho, derivative, cases[limit.load_case], by_name[limit.load_case], adjoint
            )
            / limit.limit
            for limit, adjoint in zip(near, adjoints, strict=True)
        ]
    )
    return use, _Pointwise(use=held[reach], gradients=gradients), stress, places


def _mean_exponent(model: HomogenisedModel, rho: FloatArray, weights: FloatArray) -> float:
    """Mean of d(ln C11)/d(ln rho) over the lattice, the power of the reciprocal expansion."""
    return max(float(weights @ growth_exponent(model, rho) / weights.sum()), 1.0)


def _in_reach(use: FloatArray) -> BoolArray:
    """Limits that one step can make active: used to a third of the most used one.

    Move limits of 30 % change a displacement by less than a factor of three.
    """
    return np.asarray(use > use.max() / 3.0)


def _next_allowance(allowance: float, target: float, use: float) -> float:
    """Steer the pointwise stress bound so that the percentile lands on its target.

    A percentile below target lets points exceed the limit, by at most a quarter: half a per
    cent of volume must not hide a failing cell.
    """
    if use <= 0:
        return allowance
    return float(np.clip(allowance * np.sqrt(target / use), 0.5, 1.25))


def _variable_floor(
    matrix: csr_matrix, sums: FloatArray, floor: FloatArray, lo: float
) -> FloatArray:
    """Lower bound of each variable: the filter-weighted mean of what its elements need.

    ``sums`` are the filter's column sums.
    """
    mean = np.asarray(matrix.T @ floor).ravel() / np.where(sums > 0, sums, 1.0)
    return np.maximum(np.where(sums > 0, mean, lo), floor)


def _near_enough(problem: SizingProblem, tolerance: float) -> float:
    """Largest use at which a design that stands still is taken: near the aim and within limits."""
    near = problem.target * (1 + tolerance)
    return near if problem.target >= 1.0 else min(near, 1.0)


def _mass_settled(history: Sequence[SizingStep], tolerance: float) -> bool:
    """Mass and uses have stood still for five iterations."""
    if len(history) < 8:
        return False
    mass = np.array([h.mass_g for h in history[-5:]])
    uses = np.array([(*h.displacement_use, h.stress_use, h.buckling_use) for h in history[-5:]])
    return bool(
        np.ptp(mass) <= 0.75 * tolerance * mass[-1] and np.ptp(uses, axis=0).max() <= tolerance
    )


def _calmed(calm: FloatArray, turned: FloatArray) -> FloatArray:
    """Share of the move limit for every variable: less where its steps change their sign.

    ``turned`` is the product of a variable's last two steps. As the asymptotes of Svanberg (1987,
    Int. J. Numer. Meth. Engng 24, section 4) do.
    """
    slower = np.maximum(calm * CALMER, LEAST_CALM)
    faster = np.minimum(calm * BOLDER, 1.0)
    return np.where(turned < 0, slower, np.where(turned > 0, faster, calm))


def _is_two_cycle(new: FloatArray, now: FloatArray, before: FloatArray) -> bool:
    """The step nearly undoes the last one."""
    forward, back = new - now, now - before
    size_back = float(np.linalg.norm(back))
    return size_back > 0 and float(np.linalg.norm(forward + back)) < 0.3 * size_back
