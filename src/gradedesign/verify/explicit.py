"""Analysis of the explicit lattice: the same loads and supports on its own surface."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.case.schema import Case
from gradedesign.errors import LatticeError
from gradedesign.fe.linear_solver import LinearSolver
from gradedesign.fe.load_case import case_loads, load_vector, mechanical_force, region_nodes
from gradedesign.fe.multigrid_solver import MULTIGRID
from gradedesign.fe.solution import Solution
from gradedesign.fe.solve import solve_elastic
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_von_mises
from gradedesign.lattice.domain import phase_at
from gradedesign.lattice.lattice import LatticeDesign
from gradedesign.material.material import Material
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.part_mesh import region_facets
from gradedesign.part.regions import Region
from gradedesign.verify.exclusion import ExclusionZone, exclusion_zone
from gradedesign.verify.measures import StressMeasure, stress_measures
from gradedesign.verify.neighbourhoods import neighbourhood_cells
from gradedesign.verify.phases import considered_at
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedSolid:
    """What every analysis of a printed solid needs besides its mesh.

    Attributes
    ----------
    case : Case
    design : LatticeDesign
    material : Material
    regions : mapping of name to Region
    clamped : tuple of callable
        Unsigned distances to the clamped regions.
    exclusion_radius : float, mm
    stress_limit : float or None, MPa
    percentile : float
    solver : LinearSolver
    bodies : int
        Of the part; each is held by supports of its own.
    """

    case: Case
    design: LatticeDesign
    material: Material
    regions: Mapping[str, Region]
    clamped: tuple[Field, ...]
    exclusion_radius: float
    stress_limit: float | None
    percentile: float
    solver: LinearSolver = MULTIGRID
    bodies: int = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExplicitResult:
    """Displacements and stresses of one tetrahedral mesh of the printed solid.

    Attributes
    ----------
    space : TetSpace
    solutions : tuple of Solution
        One per load case.
    von_mises : dict of load case to (M, 4) array, MPa
        At the Gauss points.
    measures : dict of load case to tuple of StressMeasure
    work : dict of load case to float, N mm
        Of loads and inertia on the displacements they cause.
    facets : dict of region to (k, 3) int array
    phase : (M,) int array
    exclusion : ExclusionZone
        What the exclusion radius leaves out of the measures.
    volume : float, mm^3
    mesh_size : float, mm
    seconds : float
    """

    space: TetSpace
    solutions: tuple[Solution, ...]
    von_mises: dict[str, FloatArray]
    measures: dict[str, tuple[StressMeasure, ...]]
    work: dict[str, float]
    facets: dict[str, IntArray]
    phase: IntArray
    exclusion: ExclusionZone
    volume: float
    mesh_size: float
    seconds: float

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""
        nodes = region_nodes(self.space, self.facets[region])
        return self._displacement(load_case)[:, nodes]

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""
        return float(np.linalg.norm(self._displacement(load_case), axis=0).max())

    def _displacement(self, load_case: str) -> FloatArray:
        return next(s for s in self.solutions if s.name == load_case).displacement


def analyse_printed_solid(
    mesh: TetMesh, judged: JudgedSolid, *, mesh_size: float, surface_tolerance: float
) -> ExplicitResult:
    """Solve every load case on a mesh of the printed solid and measure its stress.

    Parameters
    ----------
    mesh : TetMesh
    judged : JudgedSolid
    mesh_size : float, mm
        Reported beside the values.
    surface_tolerance : float, mm
        How far the mesh's surface may lie from a region of the part to count as that region.

    Returns
    -------
    ExplicitResult

    Raises
    ------
    LatticeError
        If a loaded or supported region carries no lattice.
    SolverError
        If a solve fails one of its checks.
    """
    start = time.perf_counter()
    material = judged.material
    report_step(f"supports and loads on {mesh.tets.shape[1]} tetrahedra")
    space = tet_space(mesh, 2)
    facets = found_regions(mesh, judged.regions, surface_tolerance)
    cases = case_loads(space, judged.case.load_case, judged.regions, facets)
    stiffness = IsotropicStiffness(
        E=np.full(space.element_count, material.youngs_modulus), nu=material.poissons_ratio
    )
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion) for case in cases
    ]
    solutions = solve_elastic(space, stiffness, vectors, solver=judged.solver)
    forces = [mechanical_force(space, case, density) for case in cases]
    report_step("stress measures")
    points = centroids(mesh)
    phase = phase_at(judged.design.domain, points)
    considered = considered_at(points, judged.clamped, judged.exclusion_radius)
    volumes = signed_volumes(mesh)
    von_mises: dict[str, FloatArray] = {}
    measures: dict[str, tuple[StressMeasure, ...]] = {}
    for case, solution in zip(cases, solutions, strict=True):
        stress = element_von_mises(
            space,
            stiffness,
            solution.displacement,
            thermal_strain=material.thermal_expansion * case.temperature_change,
        )
        von_mises[case.name] = stress
        measures[case.name] = stress_measures(
            points,
            volumes,
            stress,
            phase,
            considered,
            limit=judged.stress_limit or np.inf,
            percentile=judged.percentile,
            cells=neighbourhood_cells(judged.design),
        )
    return ExplicitResult(
        space=space,
        solutions=solutions,
        von_mises=von_mises,
        measures=measures,
        work=work_of(forces, solutions),
        facets=facets,
        phase=phase,
        exclusion=exclusion_zone(
            volumes,
            von_mises,
            phase,
            considered,
            radius=judged.exclusion_radius,
            percentile=judged.percentile,
        ),
        volume=float(volumes.sum()),
        mesh_size=mesh_size,
        seconds=time.perf_counter() - start,
    )


def found_regions(
    mesh: TetMesh, regions: Mapping[str, Region], tolerance: float
) -> dict[str, IntArray]:
    """Facets of every region on the surface of the mesh.

    Raises
    ------
    LatticeError
        If a region has no facets.
    """
    found: dict[str, IntArray] = {}
    for name, region in regions.items():
        facets = region_facets(mesh, region.corners, tolerance=tolerance).facets
        if len(facets) == 0:
            raise LatticeError(
                f"region '{name}' carries no solid in the lattice, so nothing can be held or "
                f"loaded there; keep it solid with a [[keep]] table, or raise the density"
            )
        found[name] = facets
    return found


def governing_measure(
    measures: Mapping[str, tuple[StressMeasure, ...]], phase: str | None = None
) -> tuple[str, StressMeasure] | None:
    """Load case and measure with the largest judged value, of one phase or of all."""
    every = [
        (case, m) for case, ms in measures.items() for m in ms if phase is None or m.phase == phase
    ]
    return max(every, key=lambda pair: pair[1].value) if every else None


def work_of(forces: Sequence[FloatArray], solutions: Sequence[Solution]) -> dict[str, float]:
    """Work of nodal forces on the displacements of their load cases, N mm."""
    return {
        solution.name: float(np.sum(force * solution.displacement))
        for force, solution in zip(forces, solutions, strict=True)
    }
