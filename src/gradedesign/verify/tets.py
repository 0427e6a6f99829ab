"""Quadratic tetrahedra as an explicit analysis: stuffed from the field, or of any mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter

import numpy as np

from gradedesign.arrays import IntArray
from gradedesign.errors import LatticeError
from gradedesign.fe.load_case import (
    case_loads,
    load_vector,
    mechanical_force,
    work_of,
)
from gradedesign.fe.solve import predict_memory_bytes, solve_elastic
from gradedesign.fe.space import tet_space
from gradedesign.mesh.tet_mesh import TetMesh
from gradedesign.part.part_mesh import region_facets
from gradedesign.part.regions import Region
from gradedesign.verify.analysis import (
    AnalysisEstimate,
    Discretisation,
    ExplicitAnalysis,
    PlannedSolid,
    Resolution,
)
from gradedesign.verify.explicit_mesh import (
    dividing_spacing,
    fitting_spacing,
    mesh_lattice,
    predict_unknowns,
)
from gradedesign.verify.grid_resolution import LAYER_ELEMENTS, elements_per_wall
from gradedesign.verify.mesh_within_budget import COARSEST, mesh_within_budget
from gradedesign.verify.printed_solid import PrintedSolid
from gradedesign.verify.tet_fields import TetFields, solid_stiffness
from gradedesign.workspace.progress import report_step

#: Tetrahedra per solid volume of one grid cell, and unknowns per tetrahedron, of walls two to
#: three elements thick: measured 13.2 to 13.8 and 4.8 to 5.0 on the cases mini and size-graded.
TETS_PER_GRID_CELL, DOFS_PER_TET = 14.0, 5.1
#: Seconds for each element of the grid (sampling its field, stuffing, snapping), for each unknown
#: (assembly, multigrid and the first load case), and what each further load case adds as a share of
#: the latter; they are solved in pairs, on one hierarchy. Measured on two idle cores: 4 to
#: 6.5e-5 and 8.4 to 9.2e-6, from 0.16 M unknowns (cases/mini) over 0.36 M (cases/bracket) to 2.9 M.
GRID_CELL_S, UNKNOWN_S, MORE_CASES = 0.5e-4, 0.9e-5, 0.45


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
        mesh_size=made.spacing,
        surface_size=made.spacing,
        surface_tets=made.mesh.tets.shape[1],
        unknowns=0,
        requested=made.requested,
        refused=made.refused,
        dropped_components=made.dropped_components,
        seconds=perf_counter() - began,
    )
    return solve_tets(made.mesh, solid, division, 0.5 * made.spacing)


def estimate(planned: PlannedSolid, spacing: float) -> AnalysisEstimate:
    """Size of the analysis on a grid of a spacing, mm."""
    counts = np.ceil(np.asarray(planned.box) / spacing) + 4
    tets = TETS_PER_GRID_CELL * planned.volume / spacing**3
    unknowns = int(tets * DOFS_PER_TET)
    return AnalysisEstimate(
        unknowns=unknowns,
        memory_bytes=predict_memory_bytes(predict_unknowns(planned.volume, spacing), 2),
        mesh_s=GRID_CELL_S * float(counts.prod()),
        solve_s=solve_seconds(unknowns, planned.load_cases),
        surface_tets=tets,
    )


def solve_seconds(unknowns: float, load_cases: int) -> float:
    """Seconds of solving every load case on two idle cores, s."""
    return UNKNOWN_S * unknowns * (1.0 + MORE_CASES * (load_cases - 1))


def fitted_spacing(planned: PlannedSolid, spacing: float, memory_bytes: float) -> float:
    """Cube that `solve_stuffed` takes, mm: one that the memory holds and that divides the box."""
    fitting = fitting_spacing(planned.volume, memory_bytes)
    if spacing < fitting <= COARSEST * spacing:
        spacing = fitting
    return dividing_spacing(planned.box, spacing, fitting)


#: Body-fitted quadratic tetrahedra by isosurface stuffing, ``[run] analysis = "tets"``.
STUFFED_TETS = ExplicitAnalysis(
    name="tets",
    solve=solve_stuffed,
    estimate=estimate,
    fitted_spacing=fitted_spacing,
    elements_per_wall=elements_per_wall,
    elements_per_layer=LAYER_ELEMENTS,
    least_per_wall=LAYER_ELEMENTS / COARSEST,
    coarsest=COARSEST,
    uses_solver=True,
)
