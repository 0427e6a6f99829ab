"""Quadratic tetrahedra of a printed solid: what a mesher makes of its surface, whole or in part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import LatticeError
from gradedesign.geometry.part.part_mesh import region_facets
from gradedesign.geometry.part.regions import Region
from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
from gradedesign.mechanics.explicit.analysis import Discretisation
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.tet_fields import TetFields
from gradedesign.mechanics.fe.elastic_system import prepare_elastic
from gradedesign.mechanics.fe.load_case import (
    case_loads,
    load_vector,
    mechanical_force,
    work_of,
)
from gradedesign.mechanics.fe.modes import found_modes
from gradedesign.mechanics.fe.solve import solve_cases
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_stress

#: Unknowns per quadratic tetrahedron of a lattice: walls two to three elements thick have 4.8 to
#: 5.0.
DOFS_PER_TET = 5.1
#: Seconds for each unknown (assembly, multigrid and the first load case), and what each further
#: load case adds as a share of it; they are solved in pairs, on one hierarchy. Measured on two idle
#: cores: 8.4 to 9.2e-6, from 0.16 to 2.9 M unknowns.
UNKNOWN_S, MORE_CASES = 0.9e-5, 0.45


def solve_tets(
    mesh: TetMesh, solid: PrintedSolid, division: Discretisation, tolerance: float
) -> TetFields:
    """Solve every load case of a printed solid on a mesh of it.

    Raises `LatticeError` if a loaded or supported region carries no lattice, and `SolverError` if a
    solve fails one of its checks.

    ``division``: of the mesh; its unknowns are counted here. ``tolerance``, mm: how far the mesh's
    surface may lie from a region of the part to count as that region.
    """
    material = solid.material
    report_step(f"supports and loads on {mesh.tets.shape[1]} tetrahedra")
    space = tet_space(mesh, 2)
    facets = _facets_of_regions(mesh, solid.regions, tolerance)
    cases = case_loads(space, solid.load_cases, solid.regions, facets)
    stiffness = dense_stiffness(space, material)
    density = np.full(space.element_count, material.density)
    vectors = [
        load_vector(space, case, stiffness, density, material.thermal_expansion) for case in cases
    ]
    system = prepare_elastic(space, stiffness, solver=solid.solver)
    solutions = solve_cases(system, vectors)
    held = {case.name: case.supports.fixed for case in cases}
    by_name = {solution.name: solution for solution in solutions}
    heated = {case.name: material.thermal_expansion * case.temperature_change for case in cases}

    def stress(name: str) -> FloatArray:
        u = by_name[name].displacement
        return element_stress(space, stiffness, u, thermal_strain=heated[name])

    forces = [mechanical_force(space, case, density) for case in cases]
    return TetFields(
        space=space,
        material=material,
        solutions=by_name,
        thermal_strain=heated,
        facets=facets,
        work=work_of(forces, solutions),
        mode_values=found_modes(
            system, held, signed_volumes(space.mesh) * density, stress, solid.modes
        ),
        division=replace(division, unknowns=space.dof_count),
    )


def _facets_of_regions(
    mesh: TetMesh, regions: Mapping[str, Region], tolerance: float
) -> dict[str, IntArray]:
    """Facets of every region on the surface of the mesh.

    Raises `LatticeError` if a region has no facets.
    """
    by_region: dict[str, IntArray] = {}
    for name, region in regions.items():
        facets = region_facets(mesh, region.corners, tolerance=tolerance).facets
        if len(facets) == 0:
            raise LatticeError(
                f"region '{name}' carries no solid, so nothing can be held or loaded there; "
                "keep it solid with a [[keep]] table, raise the density, or let a body that was "
                "made elsewhere reach it"
            )
        by_region[name] = facets
    return by_region


def solve_seconds(unknowns: float, load_cases: int) -> float:
    """Seconds of solving every load case on two idle cores, s."""
    return UNKNOWN_S * unknowns * (1.0 + MORE_CASES * (load_cases - 1))
