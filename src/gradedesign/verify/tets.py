"""Quadratic tetrahedra as an explicit analysis: stuffed from the field, or of any mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import LatticeError
from gradedesign.fe.element_points import element_points
from gradedesign.fe.field_eval import interpolate
from gradedesign.fe.load_case import (
    case_loads,
    load_vector,
    mechanical_force,
    region_nodes,
    work_of,
)
from gradedesign.fe.solution import Solution
from gradedesign.fe.solve import predict_memory_bytes, solve_elastic
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.fe.stiffness import IsotropicStiffness
from gradedesign.fe.stress import element_stress, element_von_mises, nodal_average
from gradedesign.material.material import Material
from gradedesign.mesh.boundary_surface import boundary_surface
from gradedesign.mesh.point_location import locate
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.part_mesh import region_facets
from gradedesign.part.regions import Region
from gradedesign.verify.analysis import (
    AnalysisEstimate,
    Discretisation,
    ExplicitAnalysis,
    PlannedSolid,
    Resolution,
    StressSample,
    SurfaceFields,
    VolumeFields,
)
from gradedesign.verify.explicit_mesh import (
    fitted_cube,
    fitting_cube,
    mesh_lattice,
    predict_unknowns,
)
from gradedesign.verify.grid_resolution import LAYER_CUBES, cubes_per_wall
from gradedesign.verify.mesh_within_budget import COARSEST, mesh_within_budget
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.workspace.progress import report_step

#: Tetrahedra per solid volume of one grid cube, and unknowns per tetrahedron, of walls two to
#: three cubes thick: measured 13.2 to 13.8 and 4.8 to 5.0 on the cases mini and size-graded.
TETS_PER_SOLID_CUBE, DOFS_PER_TET = 14.0, 5.1
#: Seconds for each cube of the grid (sampling its field, stuffing, sharpening), for each unknown
#: (assembly, multigrid and the first load case), and what each further load case adds as a share of
#: the latter; they are iterated in pairs, on one hierarchy. Measured in first rounds on two idle
#: cores: 0.5 to 2.7e-4 and 1.9 to 3.2e-5, from 0.28 M unknowns (cases/mini) to 3 M.
CUBE_S, UNKNOWN_S, MORE_CASES = 1.1e-4, 2.4e-5, 0.45


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TetFields:
    """Solved displacements on the quadratic tetrahedra of a printed solid.

    Attributes
    ----------
    space : TetSpace
    material : Material
    solutions : dict of load case to Solution
    thermal_strain : dict of load case to float
    facets : dict of region to (k, 3) int array
    work : dict of load case to float, N mm
    division : Discretisation
    """

    space: TetSpace
    material: Material
    solutions: Mapping[str, Solution]
    thermal_strain: Mapping[str, float]
    facets: Mapping[str, IntArray]
    work: Mapping[str, float]
    division: Discretisation

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Names, in the order of the case."""
        return tuple(self.solutions)

    @property
    def points(self) -> FloatArray:
        """Centroids, ``(3, M)``, mm."""
        return centroids(self.space.mesh)

    @property
    def volumes(self) -> FloatArray:
        """Volumes of the tetrahedra, ``(M,)``, mm^3."""
        return signed_volumes(self.space.mesh)

    def displacement(self, load_case: str) -> FloatArray:
        """Nodal displacements, ``(3, N)``, mm."""
        return self.solutions[load_case].displacement

    def von_mises(self, load_case: str) -> FloatArray:
        """Von Mises stress at the Gauss points, ``(M, 4)``, MPa."""
        return element_von_mises(
            self.space,
            solid_stiffness(self.space, self.material),
            self.displacement(load_case),
            thermal_strain=self.thermal_strain[load_case],
        )

    def stress_within(self, load_case: str, lower: FloatArray, upper: FloatArray) -> StressSample:
        """Stress at the Gauss points in the box between two corners, mm."""
        driving = self.space
        corners = driving.mesh.points[:, driving.mesh.tets]
        touching = np.all(
            (corners.max(axis=1) > lower[:, None]) & (corners.min(axis=1) < upper[:, None]), axis=0
        )
        chosen = np.flatnonzero(touching)
        used, local = np.unique(driving.mesh.tets[:, chosen], return_inverse=True)
        mesh = TetMesh(points=driving.mesh.points[:, used], tets=np.asarray(local).reshape(4, -1))
        nodes, inverse = np.unique(driving.elements[:, chosen], return_inverse=True)
        part = TetSpace(
            mesh=mesh,
            order=2,
            nodes=driving.nodes[:, nodes],
            elements=np.asarray(inverse, dtype=np.int32).reshape(10, -1),
        )
        sample = gauss_stress(
            part,
            self.material,
            self.displacement(load_case)[:, nodes],
            self.thermal_strain[load_case],
        )
        inside = np.all(
            (sample.points >= lower[:, None]) & (sample.points <= upper[:, None]), axis=0
        )
        return StressSample(
            points=sample.points[:, inside],
            volumes=sample.volumes[inside],
            stress=sample.stress[:, :, inside],
        )

    def displacement_at(self, load_case: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement at points, ``(3, m)``, mm, and their distances from the mesh, (m,), mm."""
        tets, barycentric, distance = locate(self.space.mesh, points)
        return interpolate(self.space, self.displacement(load_case), tets, barycentric), distance

    def region_displacement(self, region: str, load_case: str) -> FloatArray:
        """Displacements of the nodes of a region, ``(3, k)``, mm."""
        nodes = region_nodes(self.space, self.facets[region])
        return self.displacement(load_case)[:, nodes]

    def largest_displacement(self, load_case: str) -> float:
        """Largest displacement of any node, mm."""
        return float(np.linalg.norm(self.displacement(load_case), axis=0).max())

    def surface_fields(self, load_case: str) -> SurfaceFields:
        """Boundary facets with stress averaged at the vertices."""
        report_step("stress for the pictures")
        at_vertices = element_von_mises(
            self.space,
            solid_stiffness(self.space, self.material),
            self.displacement(load_case),
            thermal_strain=self.thermal_strain[load_case],
            at="vertices",
        )
        surface, used = boundary_surface(self.space.mesh)
        return SurfaceFields(
            surface=surface,
            von_mises=nodal_average(self.space, at_vertices)[used],
            displacement=self.displacement(load_case)[:, used],
        )

    def volume_fields(self, sampled: Mapping[str, FloatArray]) -> VolumeFields:
        """Quadratic tetrahedra with nodal displacements and fields ``(M,)``."""
        return VolumeFields(
            points=self.space.nodes,
            elements=self.space.elements.astype(np.int64),
            point_data={
                f"displacement {name} [mm]": self.displacement(name) for name in self.load_cases
            },
            element_data=sampled,
        )


def solve_tets(
    mesh: TetMesh, solid: PrintedSolid, division: Discretisation, tolerance: float
) -> TetFields:
    """Solve every load case of a printed solid on a mesh of it.

    Parameters
    ----------
    mesh : TetMesh
    solid : PrintedSolid
    division : Discretisation
        Of the mesh; its unknowns are counted here.
    tolerance : float, mm
        How far the mesh's surface may lie from a region of the part to count as that region.

    Raises
    ------
    LatticeError
        If a loaded or supported region carries no lattice.
    SolverError
        If a solve fails one of its checks.
    """
    material = solid.material
    report_step(f"supports and loads on {mesh.tets.shape[1]} tetrahedra")
    space = tet_space(mesh, 2)
    facets = facets_of_regions(mesh, solid.regions, tolerance)
    cases = case_loads(space, solid.case.load_case, solid.regions, facets)
    stiffness = solid_stiffness(space, material)
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion) for case in cases
    ]
    solutions = solve_elastic(space, stiffness, vectors, solver=solid.solver)
    forces = [mechanical_force(space, case, density) for case in cases]
    return TetFields(
        space=space,
        material=material,
        solutions={solution.name: solution for solution in solutions},
        thermal_strain={
            case.name: material.thermal_expansion * case.temperature_change for case in cases
        },
        facets=facets,
        work=work_of(forces, solutions),
        division=replace(division, unknowns=space.dof_count),
    )


def solid_stiffness(space: TetSpace, material: Material) -> IsotropicStiffness:
    """A material in every tetrahedron."""
    return IsotropicStiffness(
        E=np.full(space.element_count, material.youngs_modulus), nu=material.poissons_ratio
    )


def gauss_stress(
    space: TetSpace, material: Material, displacement: FloatArray, thermal_strain: float
) -> StressSample:
    """Stress at the four Gauss points of every element."""
    stress = element_stress(
        space, solid_stiffness(space, material), displacement, thermal_strain=thermal_strain
    )
    volumes = np.repeat(signed_volumes(space.mesh)[:, None] / 4.0, 4, axis=1)
    return StressSample(
        points=element_points(space).reshape(3, -1),
        volumes=volumes.ravel(),
        stress=stress.reshape(3, 3, -1),
    )


def facets_of_regions(
    mesh: TetMesh, regions: Mapping[str, Region], tolerance: float
) -> dict[str, IntArray]:
    """Facets of every region on the surface of the mesh.

    Raises
    ------
    LatticeError
        If a region has no facets.
    """
    by_region: dict[str, IntArray] = {}
    for name, region in regions.items():
        facets = region_facets(mesh, region.corners, tolerance=tolerance).facets
        if len(facets) == 0:
            raise LatticeError(
                f"region '{name}' carries no solid in the lattice, so nothing can be held or "
                f"loaded there; keep it solid with a [[keep]] table, or raise the density"
            )
        by_region[name] = facets
    return by_region


def solve_stuffed(
    solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
) -> TetFields:
    """Stuff the lattice with tetrahedra and solve every load case on them."""
    began = perf_counter()
    design, memory = solid.design, solid.case.run.memory
    bodies = design.domain.bodies
    if resolution.coarsest is None:
        made = mesh_lattice(design, resolution.spacing, memory_limit_bytes=memory, bodies=bodies)
    else:
        made = mesh_within_budget(
            design,
            resolution.spacing,
            coarsest=resolution.coarsest,
            memory_limit_bytes=memory,
            bodies=bodies,
            on_refusal=say,
        )
    division = Discretisation(
        made_by="stuffing",
        mesh_size=made.cube,
        surface_size=made.cube,
        surface_tets=made.mesh.tets.shape[1],
        unknowns=0,
        requested=made.asked,
        refused=made.refused,
        dropped_pieces=made.dropped_pieces,
        seconds=perf_counter() - began,
    )
    return solve_tets(made.mesh, solid, division, 0.5 * made.cube)


def estimate(planned: PlannedSolid, spacing: float) -> AnalysisEstimate:
    """Size of the analysis on grid cubes of a spacing, mm."""
    counts = np.ceil(np.asarray(planned.box) / spacing) + 4
    tets = TETS_PER_SOLID_CUBE * planned.volume / spacing**3
    unknowns = int(tets * DOFS_PER_TET)
    return AnalysisEstimate(
        unknowns=unknowns,
        memory_bytes=predict_memory_bytes(predict_unknowns(planned.volume, spacing), 2),
        mesh_s=CUBE_S * float(counts.prod()),
        solve_s=solve_seconds(unknowns, planned.load_cases),
        surface_tets=tets,
    )


def solve_seconds(unknowns: float, load_cases: int) -> float:
    """Seconds of solving every load case on two idle cores, s."""
    return UNKNOWN_S * unknowns * (1.0 + MORE_CASES * (load_cases - 1))


def fitted_spacing(planned: PlannedSolid, spacing: float, memory_bytes: float) -> float:
    """Cube that `solve_stuffed` takes, mm: one that the memory holds and that divides the box."""
    fitting = fitting_cube(planned.volume, memory_bytes)
    if spacing < fitting <= COARSEST * spacing:
        spacing = fitting
    return fitted_cube(planned.box, spacing, fitting)


#: Body-fitted quadratic tetrahedra by isosurface stuffing, ``[run] analysis = "tets"``.
STUFFED_TETS = ExplicitAnalysis(
    name="tets",
    solve=solve_stuffed,
    estimate=estimate,
    fitted_spacing=fitted_spacing,
    elements_per_wall=cubes_per_wall,
    elements_per_layer=LAYER_CUBES,
    coarsest=COARSEST,
)
