"""From one design of sizing to the next, by limits that are approximated about the former."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.sizing.analysed_design import (
    Recent,
    SolvedDesign,
    governing_values,
    solved_design,
)
from gradedesign.mechanics.sizing.filter import collected, filtered
from gradedesign.mechanics.sizing.homogenised import solid_held, solid_slope
from gradedesign.mechanics.sizing.members import (
    HALF,
    at_points,
    mean_share,
    member_price,
    step_slope,
    stepped,
)
from gradedesign.mechanics.sizing.moving_asymptotes import Step, asymptotes_step
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    density_slope,
    designed_mass,
    member_variables,
)
from gradedesign.mechanics.sizing.state import SolvedState

#: Designs that are solved from one approximation, at most: the last one is kept as it is.
_TRIALS = 4
#: Logarithm of the use of a limit over its aim that is no reason to take a design back, and share
#: of the way back to it, as approximated, that a design beyond it must go but for that. With 0.1,
#: or 0.6 of the way, members of `mini` and `cantilever-compact` weigh the same to a twentieth.
_BEYOND, _PART = 0.05, 0.3
#: Curvature over what makes the approximation say what was found (Svanberg 2002, section 4), the
#: most it grows at once, and what is left of it after a design that is kept at first. `clevis` in
#: solid and void needs some thousands where its members part; Svanberg's factor of ten from the
#: least curvature on took four designs to get there. The others are chosen, not measured.
_STEEPER, _STEEPEST, _EASED = 1.1, 1e3, 0.3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Approximation:
    """Mass and limits about a design, by their values and derivatives."""

    x: FloatArray  #: ``(n,)``. Design variables.
    cost: FloatArray  #: ``(n,)``. Derivatives of the mass over itself.
    limit: IntArray  #: ``(k,)``. Places of limits in the problem.
    values: FloatArray  #: ``(k,)``. Logarithms of utilisations over their aim.
    gradients: FloatArray  #: ``(k, n)``. Their derivatives.


def approximated(
    problem: SizingProblem, design: SolvedDesign, x: FloatArray, recent: Recent
) -> Approximation:
    """Values and derivatives at design variables ``(n,)`` that are solved."""
    governing = governing_values(problem, design, recent)
    used = governing.used / problem.target
    gradients = governing.gradients / (problem.target * used[:, None])
    carrying = HALF if problem.members is None else problem.members.threshold
    return Approximation(
        x=x,
        cost=_cost(problem, x, design.state),
        limit=governing.limit,
        values=np.log(used),
        gradients=_by_variables(problem, x, gradients, carrying),
    )


def next_design(
    problem: SizingProblem,
    near: Approximation,
    distance: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    move: float,
    curvature: FloatArray,
    recent: Recent,
) -> tuple[FloatArray, SolvedDesign, FloatArray]:
    """The lightest design near the present one that holds the limits, as approximated.

    One that passes a limit, or hardly comes nearer to it, is taken back, and the approximation made
    conservative: curved so much that it says what that design does (Svanberg 2002).

    Returns variables ``(n,)``; their design, solved; the curvature of every limit to begin with.

    - ``distance (n,)``: of the asymptotes
    - ``bounds``: pair of (n,) arrays of the variables
    - ``move``: largest step of a variable's logarithm
    - ``curvature``: of every limit in the problem, 1 at first
    """
    (least, upper), limit = bounds, near.limit
    free = least < upper
    new, curvature = least.copy(), curvature.copy()
    present = np.maximum(_by_limit(near, near.values, len(curvature)), 0.0)
    for trial in range(_TRIALS):
        step = asymptotes_step(
            near.x[free], near.cost[free], near.values, near.gradients[:, free],
            (least[free], upper[free]), distance[free], move=move, curvature=curvature[limit],
        )  # fmt: skip
        new[free] = step.x
        design = solved_design(problem, new, recent)
        with np.errstate(divide="ignore"):
            found = np.log(np.array(design.utilisations) / problem.target)
        expected = np.maximum(_by_limit(near, step.expected, len(curvature)), 0.0)
        allowed = _BEYOND + np.maximum(present - _PART * (present - expected), expected)
        worse = (found > allowed)[limit] & (step.bend > 0.0)
        if trial + 1 == _TRIALS or not worse.any():
            break
        report_step(f"taken back: a limit is used to {np.exp(found.max()):.0%} of its aim")
        curvature = _raised(near, step, found, worse, curvature)
    return new.copy(), design, curvature if trial else np.maximum(1.0, _EASED * curvature)


def _by_limit(near: Approximation, values: FloatArray, count: int) -> FloatArray:
    """Largest value of every limit, ``(count,)``; of those out of reach minus infinity."""
    most = np.full(count, -np.inf)
    np.maximum.at(most, near.limit, values)
    return most


def _raised(
    near: Approximation, step: Step, found: FloatArray, worse: BoolArray, curvature: FloatArray
) -> FloatArray:
    """Curvatures with which limits that came out worse would have been as they were ``found``.

    ``worse (k,)``: their values among those that are approximated.
    """
    raised = curvature.copy()
    for place in np.unique(near.limit[worse]):
        among = np.flatnonzero(worse & (near.limit == place))
        k = among[step.expected[among].argmax()]
        needed = curvature[place] + (found[place] - step.expected[k]) / step.bend[k]
        raised[place] = min(_STEEPER * needed, _STEEPEST * curvature[place])
    return raised


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
