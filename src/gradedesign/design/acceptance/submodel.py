"""Submodel of the exported surface, meshed anew, driven by displacements of the explicit analysis.

Cut, mesh, drive and compare are one method, and nothing else uses its parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.design.acceptance.meshed_anew import EDGE_PER_SPACING, ENVELOPE, mesh_anew
from gradedesign.design.acceptance.submodel_choice import (
    Submodel,
    clip_surface,
    cut_facets,
    inside_evaluation_box,
    submodel_box,
)
from gradedesign.errors import MeshError
from gradedesign.geometry.tets.quality import piece_labels
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.analysis import SolvedSolid, StressSample
from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.tet_fields import gauss_stress
from gradedesign.mechanics.fe.facets import facet_nodes
from gradedesign.mechanics.fe.loads import thermal_force
from gradedesign.mechanics.fe.solution import LoadVector
from gradedesign.mechanics.fe.solve import solve_elastic
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import von_mises, weighted_percentile
from gradedesign.mechanics.fe.supports import Supports
from gradedesign.mechanics.limits.banded import RESIDUAL_FACTORS
from gradedesign.mechanics.material.material import Material

#: Lower and upper corner, mm.
Box: TypeAlias = tuple[FloatArray, FloatArray]

#: Boundary force and strain energy must match the driving analysis to this share. Chosen, not
#: measured.
_MATCH = 0.03
#: Thickness of the slab behind a cut plane in which its force is taken, over the surface size, but
#: at most half of the box; the middle weighs most. Sample points lie inside or outside of a slab as
#: a whole: with equal weights in a slab of 2 a gyroid sheet's forces differed by 10 %, as much as
#: the volumes of the samples there, where mean stress differs by 0.4 % and these slabs by 0.6 %
#: (9 bricks a cell).
_SLAB = 6.0
#: Share of a submodel's cut nodes that may find no driving displacement. Chosen, not measured.
_MOST_UNDRIVEN = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class SubmodelResult:
    """One submodel, analysed on an independent mesh of the exported surface."""

    submodel: Submodel
    value: float  #: MPa. Stress percentile in the evaluation box.
    driving_value: float  #: MPa. The same percentile of the driving analysis in the same box.
    #: On the displacements of the driving analysis, so that the cut faces carry its forces.
    drive_factor: float
    #: Relative difference of cut-face forces and strain energy from the driving analysis, with that
    #: factor on its displacements.
    force_discrepancy: float
    energy_discrepancy: float  #: As `force_discrepancy`.
    matches: bool  #: Both discrepancies are within 3 %.
    volume: float  #: mm^3. Solid in the evaluation box.
    tets: int
    mesh_size: float  #: mm.
    attempts: tuple[str, ...]
    seconds: float  #: Of the mesher.


def analyse_submodel(
    surface: SurfaceMesh,
    submodel: Submodel,
    explicit: ExplicitResult,
    solid: PrintedSolid,
    *,
    size: float,
    time_limit_s: float,
) -> SubmodelResult:
    """Cut, mesh and solve one submodel, and compare it with the driving analysis.

    The forces of the driving analysis are in balance with the loads, while its displacements are
    too small by the error of its elements. The submodel, whose own error is small, is therefore
    driven by displacements times the factor with which its cut planes carry these forces, at most
    the share of error that the residual of the tractions allows: what is left counts as
    discrepancy. Without a residual, as under heat or moved supports, the factor is one.

    - ``surface``: the exported surface, read back
    - ``explicit``: drives the submodel
    - ``size``, mm: surface size of the mesh, see `mesh_anew`: sets edge length and envelope
    - ``time_limit_s``: of the mesher
    """
    driving, spacing = explicit.solved, size
    material, name = solid.material, submodel.load_case
    box = submodel_box(submodel)
    report_step("clipping")
    clipped = clip_surface(surface, *box)
    meshed = mesh_anew(clipped, solid, spacing, time_limit_s)
    report_step("driving nodes")
    mesh = _held_components(meshed.mesh, driving, name, box, spacing)
    space = tet_space(mesh, 2)
    supports = _driven_supports(space, driving, name, box, spacing)
    stiffness = dense_stiffness(space, material)
    warming = next(load.temperature_change for load in solid.load_cases if load.name == name)
    force = thermal_force(space, stiffness, material.thermal_expansion, warming)
    solution = solve_elastic(
        space,
        stiffness,
        [LoadVector(name="submodel", supports=supports, force=force)],
        solver=solid.solver,
    )[0]
    report_step("comparing stress and energy")
    fine = gauss_stress(
        space, material, solution.displacement, material.thermal_expansion * warming
    )
    coarse = driving.stress_within(name, *box)
    forces, carried = _plane_forces(fine, box, spacing), _plane_forces(coarse, box, spacing)
    factor = _drive_factor(forces, carried, driving.traction_residual.get(name))
    force_discrepancy = _force_discrepancy(factor * forces, carried)
    energy = [float((f.volumes * _energy_density(f, material)).sum()) for f in (fine, coarse)]
    # Of equal forces, on displacements that are larger by the factor.
    energy_discrepancy = abs(factor * energy[0] / energy[1] - 1.0)
    return SubmodelResult(
        submodel=submodel,
        value=factor * _percentile(fine, submodel, solid.percentile),
        driving_value=_percentile(coarse, submodel, solid.percentile),
        drive_factor=factor,
        force_discrepancy=force_discrepancy,
        energy_discrepancy=energy_discrepancy,
        matches=force_discrepancy <= _MATCH and energy_discrepancy <= _MATCH,
        volume=float(fine.volumes[inside_evaluation_box(fine.points, submodel)].sum()),
        tets=mesh.tets.shape[1],
        mesh_size=EDGE_PER_SPACING * meshed.size,
        attempts=meshed.attempts,
        seconds=meshed.seconds,
    )


def _energy_density(sample: StressSample, material: Material) -> FloatArray:
    """Strain energy per volume, ``(m,)``, N/mm^2."""
    voigt = sample.stress[[0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]
    compliance = np.linalg.inv(material.stiffness)
    return np.asarray(0.5 * (voigt * (compliance @ voigt)).sum(axis=0))


def _held_components(
    mesh: TetMesh, driving: SolvedSolid, load_case: str, box: Box, spacing: float
) -> TetMesh:
    """Drop components that no driven boundary holds: they carry nothing."""
    labels = piece_labels(mesh)
    facets, _ = boundary_facets(mesh)
    cut, _ = cut_facets(mesh.points, facets, *box, 2 * ENVELOPE * spacing)
    vertices = np.unique(cut)
    if len(vertices) == 0:
        raise MeshError("the submodel's mesh reaches none of its cut planes; nothing drives it")
    _, distance = driving.displacement_at(load_case, mesh.points[:, vertices])
    driven = np.zeros(mesh.points.shape[1], dtype=bool)
    driven[vertices[distance <= spacing]] = True
    anchored = np.bincount(labels, weights=driven[mesh.tets].sum(axis=0)) >= 3
    kept = anchored[labels]
    if kept.all():
        return mesh
    if not kept.any():
        raise MeshError(
            "no component of the submodel's mesh meets the driving analysis on a cut plane"
        )
    used, local = np.unique(mesh.tets[:, kept], return_inverse=True)
    return TetMesh(points=mesh.points[:, used], tets=np.asarray(local).reshape(4, -1))


def _driven_supports(
    space: TetSpace, driving: SolvedSolid, load_case: str, box: Box, spacing: float
) -> Supports:
    """Displacements of the explicit analysis on the submodel's cut faces.

    Nodes farther than a grid spacing from the driving solid stay free: it chamfers thin rims there.
    They may be a twentieth of the cut faces' nodes.
    """
    facets, _ = boundary_facets(space.mesh)
    cut, _ = cut_facets(space.mesh.points, facets, *box, 2 * ENVELOPE * spacing)
    nodes = np.unique(facet_nodes(space, cut))
    displacement, distance = driving.displacement_at(load_case, space.nodes[:, nodes])
    near = distance <= spacing
    if np.mean(near) < 1 - _MOST_UNDRIVEN:
        raise MeshError(
            f"{np.mean(~near):.1%} of the cut faces' nodes lie more than a grid spacing of "
            f"{spacing:.3g} mm outside the driving solid, up to {distance.max():.3g} mm; at most "
            f"{_MOST_UNDRIVEN:.0%} may; raise [run] elements_per_wall"
        )
    value = np.zeros(space.nodes.shape)
    value[:, nodes[near]] = displacement[:, near]
    fixed = np.zeros(space.nodes.shape, dtype=bool)
    fixed[:, nodes[near]] = True
    return Supports(fixed=fixed, value=value)


def _slab_force(field: StressSample, depth: FloatArray, axis: int, thickness: float) -> FloatArray:
    """Mean force through the planes of a slab, most weight on the middle one, ``(3,)``, N."""
    weight = np.maximum(1.0 - np.abs(2.0 * depth / thickness - 1.0), 0.0) * 2.0 / thickness
    return field.stress[:, axis] @ (weight * field.volumes)


def _plane_forces(field: StressSample, box: Box, spacing: float) -> FloatArray:
    """Forces through the six cut planes, ``(6, 3)``, N."""
    lower, upper = box
    forces = []
    for axis in range(3):
        thickness = min(_SLAB * spacing, 0.5 * (upper[axis] - lower[axis]))
        for bound, sign in ((lower[axis], 1.0), (upper[axis], -1.0)):
            depth = sign * (field.points[axis] - bound)
            forces.append(_slab_force(field, depth, axis, thickness))
    return np.array(forces)


def _drive_factor(fine: FloatArray, coarse: FloatArray, residual: float | None) -> float:
    """Factor that brings forces nearest to those of the driving analysis, one or more.

    At most one plus the largest share of the residual of the tractions by which displacements were
    found too small; one without a residual.
    """
    square = float((fine**2).sum())
    if residual is None or square == 0.0:
        return 1.0
    nearest = float((fine * coarse).sum()) / square
    return min(max(nearest, 1.0), 1.0 + RESIDUAL_FACTORS[-1] * residual)


def _force_discrepancy(fine: FloatArray, coarse: FloatArray) -> float:
    """Difference of the forces through the six cut planes over the largest of them."""
    size = float(np.linalg.norm(coarse, axis=1).max())
    return float(np.linalg.norm(fine - coarse, axis=1).max()) / size if size > 0 else float("inf")


def _percentile(field: StressSample, submodel: Submodel, percentile: float) -> float:
    inside = inside_evaluation_box(field.points, submodel)
    if not inside.any():
        raise MeshError(f"the submodel at {submodel.centre} mm holds no material to judge")
    return weighted_percentile(
        von_mises(field.stress[:, :, inside]), field.volumes[inside], percentile
    )
