"""Skins whose thickness follows the stress of the fully solid part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import Event, Listener, ignore, report_step
from gradedesign.design.resolve.component_place import component_place
from gradedesign.design.resolve.expected_design import expected_design
from gradedesign.design.resolve.part_tets import held_loads, part_facets, used_regions
from gradedesign.design.resolve.plan import Plan
from gradedesign.design.resolve.solid_part import solid_solutions
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.component_kind import (
    ComponentKind,
    ComponentPlace,
    composed,
    with_cuts,
)
from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.density_grid import density_grid_from_elements, evaluate
from gradedesign.geometry.lattice.placed_layout import placed_layout
from gradedesign.geometry.lattice.skin_schema import SkinSpec
from gradedesign.geometry.part.place import face_places
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets, centroids, signed_volumes
from gradedesign.mechanics.explicit.support_zones import evaluated_at
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.fe.stiffness import dense_stiffness
from gradedesign.mechanics.fe.stress import element_von_mises, weighted_percentile

#: Stress over Young's modulus below which it is the rounding of a part that nothing strains.
_NO_STRAIN = 1e-10


def with_stressed_skins(
    plan: Plan,
    kinds: Mapping[str, ComponentKind],
    space: TetSpace,
    on_event: Listener = ignore,
) -> Plan:
    """The case with skins whose thickness follows the stress of the solid part.

    Raises CaseError if the solid part carries no stress.

    ``kinds``: by name. ``space``: of the part. ``on_event``: hears of the thickness.
    """
    case, part = plan.case, plan.part
    if not any(spec.follows for spec in case.lattice.skin):
        return plan
    report_step("stress that skins follow")
    share, reference = stress_share(plan, space)
    place = component_place(case, part, [plan.cell], stress=share)
    plan = _recomposed(plan, place, kinds)
    closed = [spec for spec in case.lattice.skin if not spec.net]
    for spec, skin in zip(closed, plan.domain.of(Skin), strict=True):
        if spec.follows:
            thickness = skin.thickness_at(face_places(part, spec.faces)[0])
            on_event(Event(stage="skin", message=_skin_line(spec, thickness, reference)))
    return plan


def _recomposed(plan: Plan, place: ComponentPlace, kinds: Mapping[str, ComponentKind]) -> Plan:
    """The case with its components and cells made anew in the same part.

    Raises CaseError or LatticeError if skin and solid regions leave no lattice, or the map of the
    cells cannot be used.
    """
    domain = composed(place, kinds)
    layout = placed_layout(place.lattice, place.where, place.part, domain)
    expected = expected_design(domain, plan.cell, layout, plan.bounds)
    domain = with_cuts(place, kinds, expected, layout.least)
    kept = (said for said in plan.warnings if said not in plan.domain.notes)
    return replace(plan, domain=domain, layout=layout, warnings=(*kept, *domain.notes))


def stress_share(plan: Plan, space: TetSpace) -> tuple[Field, float]:
    """Von Mises stress of the solid part over its percentile, at most 1, and that percentile, MPa.

    That of tetrahedra at the surface, in their worst load case, as a continuous field of points
    ``(3, ...)`` mm that hardly changes with depth. The percentile is that of the limits of stress,
    outside their exclusion zones.
    """
    case, mesh = plan.case, space.mesh
    stress = _solid_stress(plan, space)
    volumes = signed_volumes(mesh)
    judged = evaluated_at(centroids(mesh), plan.support_zones)
    if not judged.any():
        judged = np.ones_like(judged)
    reference = weighted_percentile(stress[judged], volumes[judged], case.limits.percentile)
    if not reference > _NO_STRAIN * plan.material.youngs_modulus:
        raise CaseError(
            f"{case.where('lattice.skin')}: the solid part carries no stress that a skin could "
            f"follow; expected a load that strains it, or a thickness without follows"
        )
    # The surface above a skin sets its thickness: inside, the stress of bending falls.
    outer = np.unique(boundary_facets(mesh)[1])
    grid = density_grid_from_elements(
        TetMesh(points=mesh.points, tets=mesh.tets[:, outer]),
        np.minimum(stress[outer] / reference, 1.0),
        spacing=0.5 * case.part.element_size,
        margin=case.part.element_size,
        memory_limit_bytes=case.run.memory,
    )
    return partial(evaluate, grid), reference


def _solid_stress(plan: Plan, space: TetSpace) -> FloatArray:
    """Mean von Mises stress of every tetrahedron in its worst load case, ``(M,)``, MPa."""
    case, material = plan.case, plan.material
    facets = part_facets(
        plan.part,
        space.mesh,
        used_regions(case.load_case, plan.limits),
        case.part.element_size,
    )
    loads = held_loads(case.load_case, space, plan.part, facets, case.where)
    stiffness = dense_stiffness(space, material)
    worst = np.zeros(space.element_count)
    solutions = solid_solutions(space, loads, material, plan.tools.solver)
    for load, solution in zip(loads, solutions, strict=True):
        warming = material.thermal_expansion * load.temperature_change
        stress = element_von_mises(space, stiffness, solution.displacement, thermal_strain=warming)
        worst = np.maximum(worst, stress.mean(axis=1))
    return worst


def _skin_line(spec: SkinSpec, thickness: FloatArray, reference: float) -> str:
    """One line about a skin."""
    least, most = spec.thickness
    where = f"below {', '.join(spec.faces)} " if spec.faces else ""
    return (
        f"{where}as the stress of the solid part: {least:g} mm where there is none to "
        f"{most:g} mm from {reference:.3g} MPa on; {thickness.min():.3g} to {thickness.max():.3g} "
        f"mm, {thickness.mean():.3g} mm on average"
    )
