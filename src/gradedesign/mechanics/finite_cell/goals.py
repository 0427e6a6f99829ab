"""Errors of solutions, and of values of them by their duals, from tractions out of balance."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_case import LoadCaseSpecification
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.hanging import gather_hanging
from gradedesign.mechanics.finite_cell.loads import scattered
from gradedesign.mechanics.finite_cell.residual_places import ResidualPlaces, residual_places
from gradedesign.mechanics.finite_cell.result import CaseSolution, ModeValue
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.stress import displacement_at
from gradedesign.mechanics.finite_cell.surface import SurfacePoints, chosen_points
from gradedesign.mechanics.finite_cell.traction_residual import (
    Carried,
    GoalResidual,
    Imbalance,
    free_components,
    goal_residual,
    imbalance,
    nearest_on,
    traction_residual,
)

#: A loaded region carries tractions along every axis.
EVERY = (True, True, True)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dual:
    """Displacements that the forces of a goal cause."""

    u: FloatArray  #: ``(N, 3)``, mm.
    drawn: SurfacePoints  #: Where these forces act.
    traction: FloatArray  #: ``(3, k)``, MPa. With which they act there.


def goal_force(
    elements: Elements, space: BrickSpace, at: SurfacePoints, goal: DisplacementGoal, u: FloatArray
) -> tuple[FloatArray, SurfacePoints, FloatArray]:
    """Nodal forces equal to the derivative of a goal by displacements, and where they act.

    ``at``: of the goal's region. ``u (N, 3)``, mm: solution of its load case. Returns
    ``force (N, 3)``, N; ``traction (3, k)``, MPa: at these points.
    """
    moved = displacement_at(elements, space, u, at.element, at.points)
    slope = goal.by_displacement(moved, at.area)
    index = np.flatnonzero((slope != 0.0).any(axis=0))
    drawn = chosen_points(at, index)
    force = scattered(space, replace(drawn, area=np.ones(index.size)), slope[:, index])
    gather_hanging(space.hanging, force)
    # A point without area has a force and no traction.
    traction = slope[:, index] / np.where(drawn.area > 0.0, drawn.area, np.inf)
    return force, drawn, traction


def with_residuals(
    problem: CutProblem,
    elements: Elements,
    space: BrickSpace,
    places: Mapping[str, SurfacePoints],
    cases: Sequence[CaseSolution],
    duals: Mapping[Hashable, Dual],
) -> tuple[CaseSolution, ...]:
    """Solutions with the residual of their work, under forces alone, and of their goals.

    ``places``: by name; where the solid reaches the regions. ``cases``: in the order of the
    problem's load cases. ``duals``: by any key; of the problem's goals, by their keys.
    """
    moduli = problem.material.moduli
    looked_at = residual_places(elements, problem.field)
    out = []
    for specification, solution in zip(problem.cases, cases, strict=True):
        own_goals = [k for k in duals if problem.goals[k].load_case == solution.name]
        forced = _forced(specification)
        buckles = any(mode.buckling for mode in solution.modes.values())
        goals: dict[Hashable, GoalResidual] = {}
        if forced or own_goals or buckles:
            carried = _carried(specification, places)
            free = free_components(elements, looked_at, carried)
        stressed = 0.0
        if forced or buckles:
            stressed = traction_residual(
                elements, space, solution.u, moduli, looked_at, free,
                thermal_strain=solution.thermal_strain,
            )  # fmt: skip
        residual = stressed if forced else None
        if solution.modes:
            bare = free_components(elements, looked_at, _held(specification, places))
            for key, mode in solution.modes.items():
                lost = traction_residual(elements, space, mode.shape, moduli, looked_at, bare)
                goals[key] = _of_mode(mode, lost, stressed)
        if not (forced or own_goals):
            out.append(replace(solution, goals=goals))
            continue
        own = imbalance(
            elements, space, solution.u, moduli, looked_at, thermal_strain=solution.thermal_strain
        )
        for key in own_goals:
            other, neither = _dual_imbalance(duals[key], elements, space, moduli, looked_at)
            goals[key] = goal_residual(own, other, moduli, looked_at, free & neither)
        out.append(replace(solution, traction_residual=residual, goals=goals))
    return tuple(out)


def _of_mode(mode: ModeValue, lost: float, stressed: float) -> GoalResidual:
    """Residual of the value of a mode, from that of its shape and that of the stress it is under.

    A load factor is too high by the share by which the work of loads with that shape is too small,
    and a frequency by half of it. The stress that buckles the solid may be too high or too low.
    """
    if not mode.buckling:
        return GoalResidual(rise=0.0, fall=0.5 * lost * mode.value)
    return GoalResidual(rise=stressed * mode.value, fall=(lost + stressed) * mode.value)


def _dual_imbalance(
    dual: Dual,
    elements: Elements,
    space: BrickSpace,
    moduli: FloatArray,
    places: ResidualPlaces,
) -> tuple[Imbalance, BoolArray]:
    """Unbalanced tractions of the dual solution, and a mask ``(3, m)`` of those that count.

    Those of a single point are no traction: its surroundings are left out.
    """
    found = imbalance(elements, space, dual.u, moduli, places)
    if dual.drawn.area.size == 1:
        return found, free_components(elements, places, [(dual.drawn, EVERY)])
    nearest = nearest_on(elements, places, dual.drawn)
    applied = np.where(nearest >= 0, dual.traction[:, nearest], 0.0)
    outward = np.where(
        (places.free.normal * dual.drawn.normal[:, nearest]).sum(axis=0) < 0.0, -1.0, 1.0
    )
    balanced = replace(found, free=found.free - outward * applied)
    return balanced, np.ones(applied.shape, dtype=bool)


def _forced(case: LoadCaseSpecification) -> bool:
    """Whether only forces act, so that the work of the loads estimates the error."""
    moved = any(value for fix in case.fix for value in fix.displacement)
    return not (moved or case.temperature_change)


def _carried(case: LoadCaseSpecification, places: Mapping[str, SurfacePoints]) -> list[Carried]:
    """Regions on which supports and loads of a case act, with the components of these."""
    loaded: list[Carried] = [(places[load.region], EVERY) for load in case.load]
    return loaded + _held(case, places)


def _held(case: LoadCaseSpecification, places: Mapping[str, SurfacePoints]) -> list[Carried]:
    """Regions that supports of a case hold, with the components of these."""
    found: list[Carried] = []
    for fix in case.fix:
        x, y, z = (value is not None for value in fix.displacement)
        found.append((places[fix.region], (x, y, z)))
    return found
