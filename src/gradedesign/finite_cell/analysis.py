"""Linear elastic analysis of any implicit solid by quadratic finite cells."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import CaseError, SolverError
from gradedesign.finite_cell.elements import Elements, cut_elements, solid_volume
from gradedesign.finite_cell.grid import Grid, fit_grid
from gradedesign.finite_cell.iterate import Iterate, conjugate_gradients
from gradedesign.finite_cell.loads import case_force, thermal_force
from gradedesign.finite_cell.multigrid import build_preconditioner, cycle
from gradedesign.finite_cell.operator import lame_constants, operator, product
from gradedesign.finite_cell.problem import Problem, region_planes, require_regions
from gradedesign.finite_cell.result import CaseSolution, FiniteCellResult, solution_of
from gradedesign.finite_cell.space import BrickSpace, brick_space, node_points
from gradedesign.finite_cell.stress import displacement_at as displacement_in
from gradedesign.finite_cell.supports import held_by, support_key
from gradedesign.finite_cell.surface import (
    SurfacePoints,
    element_table,
    locate,
    region_points,
)
from gradedesign.finite_cell.traction_residual import residual_places, traction_residual
from gradedesign.workspace.progress import report_step, stepping

log = logging.getLogger(__name__)

#: Stiffness of the void in cut elements over that of the solid.
SOFTNESS = 1e-5
#: Error in the energy norm, over that of the solution, at which the iteration stops: 1e-7 of the
#: work of the loads. What converges later are pieces that hang by slivers: on a trimmed network of
#: 0.46 M unknowns 50 iterations reach it, and 244 a residual of 1e-6.
ENERGY = 3e-4
#: Residual over the right-hand side at which it stops even before, and the largest accepted where
#: nothing is known of the energy.
RESIDUAL = 1e-6
ACCEPTED = 1e-5
MAX_ITERATIONS = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """How closely the equations are solved.

    Attributes
    ----------
    softness : float
        Stiffness of the void in cut elements over that of the solid. The stiffness comes out too
        high by about this times the ratio of void to solid in the cut elements, weighted with
        how much the void is strained: see docs/finite-cells.md for what was measured.
    residual : float
        At which the iteration stops.
    energy : float
        Error in the energy norm, over that of the solution, at which it stops as well; 0 where the
        residual alone decides.
    """

    softness: float = SOFTNESS
    residual: float = RESIDUAL
    energy: float = ENERGY


def analyse(
    problem: Problem,
    spacing: float,
    *,
    accuracy: Accuracy = Accuracy(),
    start: FiniteCellResult | None = None,
) -> FiniteCellResult:
    """Solve every load case on finite cells of a spacing.

    Parameters
    ----------
    problem : Problem
    spacing : float, mm
        Largest edge of an element; 1.4 walls or less for 2 % in displacement.
    accuracy : Accuracy
    start : FiniteCellResult, optional
        Of a similar solid: its displacements are where the iteration starts.

    Returns
    -------
    FiniteCellResult

    Raises
    ------
    CaseError
        If a load case names a region that is not given, or supports contradict each other.
    LatticeError
        If nothing is solid, the solid falls apart, or none reaches a region.
    SolverError
        If supports leave rigid motions free, or the iteration does not converge.

    References
    ----------
    J. Parvizian, A. Düster, E. Rank (2007), Finite cell method, Comput. Mech. 41, 121-133.
    """
    if not 0.0 < accuracy.softness < 0.1:
        raise CaseError(f"softness is {accuracy.softness:g}, expected more than 0, less than 0.1")
    require_regions(problem)
    elements, space = divide(problem, spacing)
    return solve_divided(problem, elements, space, accuracy=accuracy, start=start)


def brick_grid(problem: Problem, spacing: float) -> Grid:
    """Grid of a problem: no coarser than a spacing, mm, its planes on those of the regions."""
    planes = (*problem.planes, *region_planes(problem.regions))
    return fit_grid(problem.lower, problem.upper, spacing, planes)


def divide(problem: Problem, spacing: float) -> tuple[Elements, BrickSpace]:
    """Elements of a spacing, mm, and their nodes: all that the memory of a solve depends on.

    Raises
    ------
    LatticeError
        If nothing is solid, or the solid falls apart.
    """
    elements = cut_elements(problem.field, brick_grid(problem, spacing), bodies=problem.bodies)
    return elements, brick_space(elements)


def solve_divided(
    problem: Problem,
    elements: Elements,
    space: BrickSpace,
    *,
    accuracy: Accuracy = Accuracy(),
    start: FiniteCellResult | None = None,
) -> FiniteCellResult:
    """Solve every load case on given elements; parameters and errors are those of `analyse`."""
    begin = time.process_time()
    places = {
        name: region_points(elements, problem.field, region)
        for name, region in problem.regions.items()
    }
    solutions = _solved(problem, elements, space, places, accuracy, start)
    volume = solid_volume(elements)
    material = problem.material
    result = FiniteCellResult(
        elements=elements,
        space=space,
        solutions=solutions,
        places=places,
        volume=volume,
        spacing=float(elements.grid.edges.max()),
        unknowns=3 * len(space.place),
        processor_seconds=time.process_time() - begin,
        lame=lame_constants(material.youngs_modulus, material.poissons_ratio),
        notes=_notes(elements),
    )
    log.info(
        "finite cells of %.4g mm: %d unknowns, %.1f s of processor time",
        result.spacing, result.unknowns, result.processor_seconds,
    )  # fmt: skip
    return result


def _solved(
    problem: Problem,
    elements: Elements,
    space: BrickSpace,
    places: Mapping[str, SurfacePoints],
    accuracy: Accuracy,
    start: FiniteCellResult | None,
) -> tuple[CaseSolution, ...]:
    """Solve all load cases; those of equal supports share the set-up."""
    material = problem.material
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    modulus = lame[0] + 2.0 * lame[1]
    acting = {part.region for case in problem.cases for part in (*case.fix, *case.load)}
    balance = residual_places(elements, problem.field, [places[n].element for n in acting])
    groups: dict[object, list[int]] = {}
    for k, case in enumerate(problem.cases):
        groups.setdefault(support_key(case), []).append(k)
    solved: dict[int, CaseSolution] = {}
    for members in groups.values():
        held = [
            held_by(elements, space, problem.cases[k], problem.regions, places, modulus)
            for k in members
        ]
        stiffness = operator(elements, space, lame, accuracy.softness, held[0].springs)
        levels = build_preconditioner(elements, space, stiffness, accuracy.softness, held[0].fixed)
        precondition = cycle(levels)
        keep = (~held[0].fixed).astype(np.float64)
        for k, own in zip(members, held, strict=True):
            case = problem.cases[k]
            mechanical = case_force(elements, space, case, problem.regions, places, material)
            force = mechanical + own.spring_force
            if case.temperature_change:
                force += thermal_force(elements, space, case.temperature_change, material)
            right = keep * (force - product(stiffness, own.value) if own.value.any() else force)
            with stepping(f"solving {case.name}"):
                solution = conjugate_gradients(
                    stiffness, keep, right, precondition,
                    rtol=accuracy.residual, energy=accuracy.energy,
                    max_iterations=MAX_ITERATIONS,
                    start=_start(elements, space, start, case.name),
                )  # fmt: skip
            _require_converged(case.name, solution, accuracy)
            u = solution.u + own.value
            strain = material.thermal_expansion * case.temperature_change
            loaded_only = strain == 0.0 and not own.value.any() and not own.spring_force.any()
            solved[k] = CaseSolution(
                name=case.name,
                u=u,
                energy=0.5 * float(np.einsum("nc,nc->", u, product(stiffness, u))),
                work=float(np.einsum("nc,nc->", u, mechanical)),
                iterations=solution.iterations,
                residual=solution.residual,
                thermal_strain=strain,
                traction_residual=(
                    traction_residual(elements, space, u, lame, balance) if loaded_only else None
                ),
            )
            log.info(
                "'%s': %d iterations, residual %.1e, error %.1e",
                case.name,
                solution.iterations,
                solution.residual,
                solution.error,
            )
    return tuple(solved[k] for k in range(len(problem.cases)))


def _start(
    elements: Elements, space: BrickSpace, start: FiniteCellResult | None, load_case: str
) -> FloatArray | None:
    """Displacement of an earlier result at the nodes; 0 where it had no element."""
    if start is None or load_case not in {s.name for s in start.solutions}:
        return None
    report_step("first guess")
    points = node_points(elements, space)
    # A node lies between elements: look slightly towards the solid of one that it belongs to.
    owner = np.zeros(points.shape[1], np.int64)
    owner[space.nodes] = np.arange(len(space.nodes))[:, None]
    grid = elements.grid
    share = elements.share / elements.share.sum(axis=1, keepdims=True)
    middle = np.full((len(elements.position), 3), 0.5)
    middle[elements.whole :] = (share[:, :, None] * elements.centre).sum(axis=1)
    solid = grid.lower[:, None] + grid.edges[:, None] * (elements.position + middle)[owner].T
    inner = points + 1e-6 * (solid - points)
    element: IntArray = locate(start.elements, element_table(start.elements), inner, solid)
    known = element >= 0
    u = np.zeros((points.shape[1], 3))
    u[known] = displacement_in(
        start.elements, start.space, solution_of(start, load_case).u, element[known],
        points[:, known],
    ).T  # fmt: skip
    return u


def _require_converged(name: str, ended: Iterate, accuracy: Accuracy) -> None:
    """Refuse what did not converge."""
    if not (ended.residual <= ACCEPTED or 0.0 < ended.error <= accuracy.energy):
        raise SolverError(
            f"load case '{name}': the finite cells stopped after {ended.iterations} iterations at "
            f"a residual of {ended.residual:.1e} and an error of {ended.error:.1e} in the energy "
            f"norm, where {ACCEPTED:g} or {accuracy.energy:g} is accepted; use a larger softness "
            "or another spacing"
        )


def _notes(elements: Elements) -> tuple[str, ...]:
    """Sentences on planes that are not aligned and components that were left out."""
    notes = [
        f"the plane face at {'xyz'[p.axis]} = {p.place:.6g} mm ({p.area:.4g} mm^2) lies between "
        "the grid planes of the finite cells"
        for p in elements.grid.missed
    ]
    if elements.dropped:
        notes.append(
            f"{elements.dropped} disconnected components, "
            f"{100 * elements.dropped_share:.2g} % of the volume, "
            "were left out"
        )
    return tuple(notes)
