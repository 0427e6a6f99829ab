"""All load cases of a divided solid; those of equal supports share the set-up."""

from __future__ import annotations

import logging
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.errors import SolverError
from gradedesign.mechanics.fe.displacement_goal import DisplacementGoal
from gradedesign.mechanics.fe.load_case import LoadCaseSpecification
from gradedesign.mechanics.fe.modes import highest_mode
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.goals import Dual, goal_force, with_residuals
from gradedesign.mechanics.finite_cell.hanging import gather_hanging
from gradedesign.mechanics.finite_cell.held_system import HeldSystem
from gradedesign.mechanics.finite_cell.iterate import Iterate, conjugate_gradients
from gradedesign.mechanics.finite_cell.loads import case_force, thermal_force
from gradedesign.mechanics.finite_cell.modes import buckling_modes, natural_modes
from gradedesign.mechanics.finite_cell.multigrid import build_preconditioner, cycle
from gradedesign.mechanics.finite_cell.nearest_combination import nearest_combination
from gradedesign.mechanics.finite_cell.operator import operator, product
from gradedesign.mechanics.finite_cell.result import CaseSolution, ModeValue
from gradedesign.mechanics.finite_cell.space import BrickSpace, unknown_count
from gradedesign.mechanics.finite_cell.supports import Held, held_by, support_key
from gradedesign.mechanics.finite_cell.surface import SurfacePoints

log = logging.getLogger(__name__)

#: Stiffness of the void in cut elements over that of the solid. 23 iterations, 22 with 1e-4; the
#: bias is about 0.01 %.
_SOFTNESS = 1e-5
#: Error in the energy norm, over that of the solution, at which the iteration stops: 1e-7 of the
#: work of the loads. What converges later are pieces that hang by slivers: on a trimmed network of
#: 0.46 M unknowns 50 iterations reach it, and 244 a residual of 1e-6.
_ENERGY = 3e-4
#: Residual over the right-hand side at which it stops even before, and the largest accepted where
#: nothing is known of the energy. Chosen, not measured.
_RESIDUAL = 1e-6
#: Ten times the residual that is aimed at. Chosen, not measured.
ACCEPTED = 1e-5
#: Many times what solids of one piece take (17 to 41); a solid that hardly hangs together takes
#: more. Chosen, not measured.
MAX_ITERATIONS = 400
#: Error of a dual in the energy norm at which its iteration stops: it weighs an error estimate.
#: Chosen, not measured.
DUAL_ENERGY = 1e-2
#: Displacements of load cases from which modes start at most: each takes the memory of three
#: vectors. Chosen, not measured.
_SIMILAR = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Tolerance to which the equations are solved."""

    #: Stiffness of the void in cut elements over that of the solid. The stiffness comes out too
    #: high by about this times the ratio of void to solid in the cut elements, weighted with how
    #: much the void is strained: see docs/finite-cells.md for what was measured.
    softness: float = _SOFTNESS
    residual: float = _RESIDUAL  #: At which the iteration stops.
    #: Error in the energy norm, over that of the solution, at which it stops as well; 0 where the
    #: residual alone decides.
    energy: float = _ENERGY


#: Where nothing else is asked for.
USUAL = Accuracy()


def solved_cases(
    problem: CutProblem,
    elements: Elements,
    space: BrickSpace,
    places: Mapping[str, SurfacePoints],
    accuracy: Accuracy,
) -> tuple[CaseSolution, ...]:
    """Solve all load cases; those of equal supports share the set-up."""
    moduli = problem.material.moduli
    modulus = float(moduli[0].max())
    groups: dict[object, list[int]] = {}
    for k, case in enumerate(problem.cases):
        groups.setdefault(support_key(case), []).append(k)
    goals = problem.goals if space.hanging is None else {}
    solved: dict[int, CaseSolution] = {}
    duals: dict[Hashable, Dual] = {}
    for members in groups.values():
        held = [
            held_by(elements, space, problem.cases[k], problem.regions, places, modulus)
            for k in members
        ]
        stiffness = operator(elements, space, moduli, accuracy.softness, held[0].springs)
        fixed = held[0].fixed.copy()
        fixed[unknown_count(space) // 3 :] = True
        levels = build_preconditioner(elements, space, stiffness, accuracy.softness, fixed)
        system = HeldSystem(
            elements=elements, space=space, places=places, stiffness=stiffness, keep=levels.keep,
            precondition=cycle(levels),
        )  # fmt: skip
        free: list[FloatArray] = []
        for k, own in zip(members, held, strict=True):
            solved[k] = _solved_case(problem, problem.cases[k], own, system, accuracy, free)
            duals |= {
                key: _dual(goal, solved[k], system, free)
                for key, goal in goals.items()
                if goal.load_case == solved[k].name
            }
        for k in members:
            buckling = _load_factors(problem, solved[k], system, moduli, free)
            solved[k] = replace(solved[k], modes=buckling)
        for k, frequencies in _frequencies(problem, members, system, free).items():
            solved[k] = replace(solved[k], modes={**solved[k].modes, **frequencies})
        # The largest arrays go before those of the error estimate come.
        del levels, system, stiffness, held, own, free
    cases = tuple(solved[k] for k in range(len(problem.cases)))
    # The size of a residual relative to the error was measured on elements of one size.
    if space.hanging is not None:
        return cases
    return with_residuals(problem, elements, space, places, cases, duals)


def _frequencies(
    problem: CutProblem, members: Sequence[int], system: HeldSystem, free: Sequence[FloatArray]
) -> dict[int, dict[Hashable, ModeValue]]:
    """Natural frequencies of load cases that share their supports, by number of the case."""
    names = {problem.cases[k].name: k for k in members}
    wanted = {
        key: goal
        for key, goal in problem.modes.items()
        if goal.load_case in names and not goal.buckling
    }
    if not wanted:
        return {}
    modes = natural_modes(
        system, problem.material.density, highest_mode(wanted.values()), free[:_SIMILAR],
        next(iter(wanted.values())).load_case,
    )  # fmt: skip
    found: dict[int, dict[Hashable, ModeValue]] = {}
    for key, goal in wanted.items():
        shape = modes.shapes[goal.number - 1].reshape(system.keep.shape)
        value = float(modes.frequencies[goal.number - 1])
        of_case = found.setdefault(names[goal.load_case], {})
        of_case[key] = ModeValue(value=value, shape=shape)
    return found


def _load_factors(
    problem: CutProblem,
    solution: CaseSolution,
    system: HeldSystem,
    moduli: FloatArray,
    free: Sequence[FloatArray],
) -> dict[Hashable, ModeValue]:
    """Factor of its loads at which the solid buckles in one load case, where it is asked for."""
    wanted = [
        key
        for key, goal in problem.modes.items()
        if goal.buckling and goal.load_case == solution.name
    ]
    if not wanted:
        return {}
    stressed = solution.u, solution.thermal_strain
    modes = buckling_modes(system, stressed, moduli, free[:_SIMILAR], solution.name)
    shape = modes.shapes[0].reshape(system.keep.shape)
    value = ModeValue(value=float(modes.values[0]), shape=shape, buckling=True)
    return dict.fromkeys(wanted, value)


def _dual(
    goal: DisplacementGoal, solution: CaseSolution, system: HeldSystem, free: list[FloatArray]
) -> Dual:
    """Solve the dual problem of a goal; later solves use its solution as first guess."""
    elements, space = system.elements, system.space
    right, drawn, traction = goal_force(
        elements, space, system.places[goal.region], goal, solution.u
    )
    right *= system.keep
    with stepping(f"error estimate of {goal.region} in {solution.name}"):
        solved = conjugate_gradients(
            system.stiffness, system.keep, right, system.precondition,
            rtol=_RESIDUAL, energy=DUAL_ENERGY, max_iterations=MAX_ITERATIONS,
            start=nearest_combination(system.stiffness, system.keep, right, free),
        )  # fmt: skip
    free.append(solved.u)
    log.info(
        "dual of %s in '%s': %d iterations, error %.1e",
        goal.region, solution.name, solved.iterations, solved.error,
    )  # fmt: skip
    return Dual(u=solved.u, drawn=drawn, traction=traction)


def _solved_case(
    problem: CutProblem,
    case: LoadCaseSpecification,
    own: Held,
    system: HeldSystem,
    accuracy: Accuracy,
    free: list[FloatArray],
) -> CaseSolution:
    """Solve one load case; ``free`` are the solutions before it, without prescribed values."""
    elements, space, stiffness = system.elements, system.space, system.stiffness
    material = problem.material
    mechanical = case_force(elements, space, case, problem.regions, system.places, material)
    right = mechanical.copy()
    if own.spring_force is not None:
        right += own.spring_force
    if case.temperature_change:
        right += thermal_force(elements, space, case.temperature_change, material)
    gather_hanging(space.hanging, right)
    if own.value is not None:
        right -= product(stiffness, own.value)
    right *= system.keep
    with stepping(f"solving {case.name}"):
        solution = conjugate_gradients(
            stiffness, system.keep, right, system.precondition,
            rtol=accuracy.residual, energy=accuracy.energy, max_iterations=MAX_ITERATIONS,
            start=nearest_combination(stiffness, system.keep, right, free),
        )  # fmt: skip
    _require_converged(case.name, solution, accuracy)
    free.append(solution.u)
    u = solution.u if own.value is None else solution.u + own.value
    log.info(
        "'%s': %d iterations, residual %.1e, error %.1e",
        case.name, solution.iterations, solution.residual, solution.error,
    )  # fmt: skip
    energy = 0.5 * float(np.einsum("nc,nc->", u, product(stiffness, u))) + own.spring_energy
    if own.spring_force is not None:
        energy -= float(np.einsum("nc,nc->", u, own.spring_force))
    return CaseSolution(
        name=case.name,
        u=u,
        energy=energy,
        work=float(np.einsum("nc,nc->", u, mechanical)),
        iterations=solution.iterations,
        residual=solution.residual,
        thermal_strain=material.thermal_expansion * case.temperature_change,
        traction_residual=None,
    )


def _require_converged(name: str, ended: Iterate, accuracy: Accuracy) -> None:
    """Refuse what did not converge."""
    if not (ended.residual <= ACCEPTED or 0.0 < ended.error <= accuracy.energy):
        raise SolverError(
            f"load case '{name}': the finite cells stopped after {ended.iterations} iterations at "
            f"a residual of {ended.residual:.1e} and an error of {ended.error:.1e} in the energy "
            f"norm, where {ACCEPTED:g} or {accuracy.energy:g} is accepted; use a larger softness "
            "or another spacing"
        )
