"""Linear elastic analysis of any implicit solid by quadratic finite cells."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray, IntArray, locked
from gradedesign.errors import CaseError, SolverError
from gradedesign.fe.load_case import LoadCaseSpecification
from gradedesign.finite_cell.elements import Elements, cut_elements, solid_volume
from gradedesign.finite_cell.grid import Plane, fit_grid
from gradedesign.finite_cell.iterate import conjugate_gradients
from gradedesign.finite_cell.loads import case_force, thermal_force
from gradedesign.finite_cell.multigrid import build_preconditioner, cycle
from gradedesign.finite_cell.operator import lame_constants, operator, product
from gradedesign.finite_cell.space import BrickSpace, brick_space, node_points
from gradedesign.finite_cell.stress import displacement_at as displacement_in
from gradedesign.finite_cell.stress import solid_points, stress_at
from gradedesign.finite_cell.supports import held_by, support_key
from gradedesign.finite_cell.surface import (
    SurfacePoints,
    element_table,
    locate,
    region_points,
)
from gradedesign.material.material import Material
from gradedesign.part.regions import Region
from gradedesign.workspace.progress import report_step, stepping

log = logging.getLogger(__name__)

#: Stiffness of the void in cut elements over that of the solid.
SOFTNESS = 1e-5
#: Residual at which the iteration stops, over the right-hand side, and the largest accepted.
RESIDUAL = 1e-6
ACCEPTED = 1e-5
MAX_ITERATIONS = 400


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """A solid with its loads and supports.

    Attributes
    ----------
    field : callable
        Points ``(3, ...)`` in mm to values ``(...)``, negative inside the solid.
    lower, upper : (3,) array, mm
        Box of the part; the solid ends at its faces.
    cases : tuple of LoadCaseSpecification
    regions : mapping of name to Region
        Of the part's surface; every one named in a load case, and others to measure on.
    material : Material
    planes : tuple of Plane
        Plane faces inside the box to lay grid planes on, such as those of passive solids; the
        plane regions are added.
    bodies : int
        Connected pieces that belong to the solid.
    """

    field: Field
    lower: FloatArray
    upper: FloatArray
    cases: tuple[LoadCaseSpecification, ...]
    regions: Mapping[str, Region]
    material: Material
    planes: tuple[Plane, ...] = ()
    bodies: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", locked(self.lower, (3,), name="lower"))
        object.__setattr__(self, "upper", locked(self.upper, (3,), name="upper"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseSolution:
    """Displacement of one load case.

    Attributes
    ----------
    name : str
    u : (N, 3) array, mm
        At the nodes of the elements.
    energy : float, N mm
        Strain energy, that of springs and of the soft void included.
    work : float, N mm
        Of loads and inertia on the displacements they cause.
    iterations : int
    residual : float
        Norm of unbalanced forces over that of the right-hand side.
    thermal_strain : float
    """

    name: str
    u: FloatArray
    energy: float
    work: float
    iterations: int
    residual: float
    thermal_strain: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteCellResult:
    """What an analysis found.

    Attributes
    ----------
    elements : Elements
    space : BrickSpace
    solutions : tuple of CaseSolution
        One per load case.
    places : dict of name to SurfacePoints
        Where the solid reaches each region.
    volume : float, mm^3
    mass : float, t
    spacing : float, mm
        Longest edge of an element.
    unknowns : int
    processor_seconds : float
    lame : (float, float), MPa
    notes : tuple of str
        What could not be aligned or was left out, in words.
    """

    elements: Elements
    space: BrickSpace
    solutions: tuple[CaseSolution, ...]
    places: dict[str, SurfacePoints]
    volume: float
    mass: float
    spacing: float
    unknowns: int
    processor_seconds: float
    lame: tuple[float, float]
    notes: tuple[str, ...] = ()

    @property
    def work(self) -> dict[str, float]:
        """Work of loads and inertia on the displacements they cause, by load case, N mm."""
        return {s.name: s.work for s in self.solutions}

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements where the solid reaches a region, ``(3, k)``, mm."""
        at = self.places[region]
        u = solution_of(self, load_case).u
        return displacement_in(self.elements, self.space, u, at.element, at.points)

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of the solid, mm: of the centroids of its sub-cells."""
        at = solid_points(self.elements)
        u = solution_of(self, load_case).u
        found = displacement_in(self.elements, self.space, u, at.element, at.points)
        return float(np.linalg.norm(found, axis=0).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressSample:
    """Stress where the solid is.

    Attributes
    ----------
    points : (3, m) array, mm
        Centroids of the solid in the sub-cells of the elements.
    volume : (m,) array, mm^3
        Solid that each point stands for.
    stress : (3, 3, m) array, MPa
    """

    points: FloatArray
    volume: FloatArray
    stress: FloatArray


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
    """

    softness: float = SOFTNESS
    residual: float = RESIDUAL


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
    begin = time.process_time()
    if not 0.0 < accuracy.softness < 0.1:
        raise CaseError(f"softness is {accuracy.softness:g}, expected more than 0, less than 0.1")
    _require_regions(problem)
    planes = (*problem.planes, *region_planes(problem.regions))
    grid = fit_grid(problem.lower, problem.upper, spacing, planes)
    elements = cut_elements(problem.field, grid, bodies=problem.bodies)
    space = brick_space(elements.position, 2)
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
        mass=volume * material.density,
        spacing=float(grid.edges.max()),
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


def region_planes(regions: Mapping[str, Region]) -> tuple[Plane, ...]:
    """Planes of the triangles of regions that lie across an axis, with their areas."""
    area: dict[tuple[int, float], float] = {}
    for region in regions.values():
        corners = region.corners
        size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for axis in range(3):
            flat = np.ptp(corners[:, :, axis], axis=1) < 1e-9 * size
            for k in np.flatnonzero(flat):
                key = axis, round(float(corners[k, 0, axis]), 9)
                area[key] = area.get(key, 0.0) + 0.5 * float(np.linalg.norm(across[k]))
    return tuple(Plane(axis=a, place=p, area=s) for (a, p), s in area.items())


def stress_sample(result: FiniteCellResult, load_case: str) -> StressSample:
    """Stress of a load case at points of the solid."""
    solution = solution_of(result, load_case)
    at = solid_points(result.elements)
    stress = stress_at(
        result.elements, result.space, solution.u, result.lame, at, solution.thermal_strain
    )
    return StressSample(points=at.points, volume=at.volume, stress=stress)


def displacement_at(result: FiniteCellResult, load_case: str, points: FloatArray) -> FloatArray:
    """Displacement of a load case at points ``(3, m)``, ``(3, m)``, mm.

    Raises
    ------
    CaseError
        If a point lies in no element.
    """
    element = locate(result.elements, element_table(result.elements), points)
    if (element < 0).any():
        k = int(np.argmin(element))
        raise CaseError(
            f"{np.count_nonzero(element < 0)} points lie outside the solid, such as "
            f"{points[:, k]} mm"
        )
    solution = solution_of(result, load_case)
    return displacement_in(result.elements, result.space, solution.u, element, points)


def displacement_on(
    result: FiniteCellResult, region: str, load_case: str, component: int | None
) -> float:
    """Largest displacement of a region's solid, magnitude or absolute component, mm."""
    u = result.region_displacement(region, load_case)
    values = np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])
    return float(values.max())


def solution_of(result: FiniteCellResult, load_case: str) -> CaseSolution:
    """Solution of a load case by name."""
    return next(s for s in result.solutions if s.name == load_case)


def _require_regions(problem: Problem) -> None:
    """Refuse load cases that name a region that is not given."""
    if not problem.cases:
        raise CaseError("no load case is given; expected one or more")
    for case in problem.cases:
        for name in (*(f.region for f in case.fix), *(s.region for s in case.load)):
            if name not in problem.regions:
                raise CaseError(
                    f"load case '{case.name}' names region '{name}', but the regions are "
                    f"{', '.join(problem.regions)}"
                )


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
                found = conjugate_gradients(
                    stiffness, keep, right, precondition,
                    rtol=accuracy.residual, max_iterations=MAX_ITERATIONS,
                    start=_start(elements, space, start, case.name),
                )  # fmt: skip
            _require_converged(case.name, found.residual, found.iterations)
            u = found.u + own.value
            solved[k] = CaseSolution(
                name=case.name,
                u=u,
                energy=0.5 * float(np.einsum("nc,nc->", u, product(stiffness, u))),
                work=float(np.einsum("nc,nc->", u, mechanical)),
                iterations=found.iterations,
                residual=found.residual,
                thermal_strain=material.thermal_expansion * case.temperature_change,
            )
            log.info(
                "'%s': %d iterations, residual %.1e", case.name, found.iterations, found.residual
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
    # A node lies between elements: look slightly towards the middle of one that it belongs to.
    owner = np.zeros(points.shape[1], np.int64)
    owner[space.nodes] = np.arange(len(space.nodes))[:, None]
    grid = elements.grid
    middle = grid.lower[:, None] + grid.edges[:, None] * (elements.position[owner].T + 0.5)
    inner = points + 1e-6 * (middle - points)
    element: IntArray = locate(start.elements, element_table(start.elements), inner)
    known = element >= 0
    u = np.zeros((points.shape[1], 3))
    u[known] = displacement_in(
        start.elements, start.space, solution_of(start, load_case).u, element[known],
        points[:, known],
    ).T  # fmt: skip
    return u


def _require_converged(name: str, residual: float, iterations: int) -> None:
    """Refuse what did not converge."""
    if not residual <= ACCEPTED:
        raise SolverError(
            f"load case '{name}': the finite cells stopped after {iterations} iterations at a "
            f"residual of {residual:.1e}, where {ACCEPTED:g} is accepted; use a larger softness "
            "or another spacing"
        )


def _notes(elements: Elements) -> tuple[str, ...]:
    """What could not be aligned or was left out."""
    notes = [
        f"the plane face at {'xyz'[p.axis]} = {p.place:.6g} mm ({p.area:.4g} mm^2) lies between "
        "the grid planes of the finite cells"
        for p in elements.grid.missed
    ]
    if elements.dropped:
        notes.append(
            f"{elements.dropped} loose pieces, {100 * elements.dropped_share:.2g} % of the volume, "
            "were left out"
        )
    return tuple(notes)
