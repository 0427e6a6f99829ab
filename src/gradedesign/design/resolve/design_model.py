"""A planned case on the tetrahedra of its part, with laws, loads and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.progress import Listener, ignore, report_step, stepping
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.analysable import Analysable
from gradedesign.design.resolve.analysable_lattice import analysable_lattice
from gradedesign.design.resolve.cell_choice import CellChoice, cell_axes
from gradedesign.design.resolve.expected_design import expected_density, expected_design
from gradedesign.design.resolve.part_tets import held_loads, part_facets, part_tets, used_regions
from gradedesign.design.resolve.plan import Plan, resolve_case
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import density_bounds
from gradedesign.design.resolve.resolve_law import resolve_law
from gradedesign.design.resolve.stressed_skins import with_stressed_skins
from gradedesign.design.resolve.symmetry import symmetry_warnings
from gradedesign.design.resolve.zone_laws import ZoneLaws, zone_laws, zoning
from gradedesign.design.resolve.zoning import zone_windows, zoned_laws
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.cell_layout import layout_warnings
from gradedesign.geometry.lattice.components.joint import adds_to_cells, joint_fraction
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.mechanics.explicit.support_zones import evaluated_at
from gradedesign.mechanics.fe.free_pieces import connected_pieces
from gradedesign.mechanics.fe.load_case import region_nodes, region_shares
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stiffness import UNIFORM
from gradedesign.mechanics.limits.kinds import made_limits
from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel
from gradedesign.mechanics.limits.local_stress import allowed_stress
from gradedesign.mechanics.limits.row import LEAST_JUDGED, LimitRow
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.sizing.homogenised_model import (
    HomogenisedModel,
    homogenised_model,
    with_void,
)
from gradedesign.mechanics.sizing.solid_moments import solid_fraction, solid_moments

#: Share of solid from which on a tetrahedron belongs to a kept solid. Chosen, not measured: whether
#: that moves as a rigid body is looked at anyway.
_KEPT = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignModel:
    """A planned case meshed, loaded and limited: what sizing and its iterations work on."""

    #: With the skins that follow stress, and the analysis at the resolution that memory allows.
    plan: Plan
    #: The part's tetrahedra with their laws and loads, without corrections, in these cells.
    homogenised: HomogenisedModel
    cells: CellChoice  #: Laid out anew for every design where their size is graded.
    #: Those relative to the solid part are resolved by `solid.with_solid`.
    limits: tuple[Limit, ...]
    #: By region, each ``(k, 3)``. Of the tetrahedra, for every region that a load or a limit names.
    facets: dict[str, IntArray]
    warnings: tuple[str, ...]
    #: Every limit with its value on the fully solid part, once that is analysed.
    solid: tuple[LimitRow, ...] = ()
    #: Of the fully solid part in every load case, once it is analysed.
    solutions: tuple[Solution, ...] = ()
    #: Warning that the fully solid part yields; empty where it does not.
    solid_yields: tuple[str, ...] = ()


def prepare(case: Case, registry: Registry, on_event: Listener = ignore) -> DesignModel:
    """Resolve names, read and mesh the part, find its regions, apply its loads.

    Raises `GradeDesignError` as `resolve_case`, `resolve_law` and the mesher; if a limit judges too
    little of the part. Raises `ResourceError` if the memory of the case holds no density of its
    window.
    """
    plan = resolve_case(case, registry)
    case, lattice, cell = plan.case, plan.case.lattice, plan.cell
    with locating(case.where, "lattice.law"):
        law, law_warnings = resolve_law(
            lattice, case.limits, registry, cell, case.where, on_event,
            poissons_ratio=plan.material.poissons_ratio,
        )  # fmt: skip
    least = plan.layout.least
    bounds, narrowed = density_bounds(lattice, case.print, cell, law, least, case.where)
    laws = zone_laws(plan, registry, law, on_event)
    with locating(case.where, "part.mesh_size"), stepping("meshing the part"):
        mesh = part_tets(case.part, plan.part, plan.tools.mesher, case.run)
    space, volumes = tet_space(mesh, 2), signed_volumes(mesh)
    plan = with_stressed_skins(plan, registry.components, space, on_event)
    report_step("supports, loads and solid volume fractions of the part")
    moments = counted_solid(plan, bounds, mesh)
    shares = solid_fraction(moments)
    able = analysable_lattice(
        plan,
        (bounds,) if laws is None else laws.bounds,
        latticed=float(volumes @ (1 - shares)),
        solid=float(volumes @ shares),
    )
    plan = replace(plan, tools=replace(plan.tools, analysis=able.analysis))
    cells, field, zone_warnings = _cells_and_laws(plan, law, laws, able, mesh, on_event)
    names = used_regions(case.load_case, plan.limits)
    facets = part_facets(plan.part, mesh, names, case.part.element_size)
    homogenised = homogenised_model(
        space,
        shares,
        plan.material,
        field,
        held_loads(case.load_case, space, plan.part, facets, case.where),
        rotation=cell_axes(cells.layout, space),
        solver=plan.tools.solver,
        solid_moments=moments,
    )
    if not lattice.cells:
        homogenised = with_void(homogenised, cells.bounds)
    limits, limit_warnings = _placed_limits(plan, homogenised, facets, registry.limits)
    return DesignModel(
        plan=plan,
        homogenised=homogenised,
        cells=cells,
        limits=limits,
        facets=facets,
        warnings=(
            *able.warnings,
            *(*plan.warnings, *law_warnings, *narrowed, *zone_warnings, *limit_warnings),
            *layout_warnings(cells.layout, law.name),
            *symmetry_warnings(plan.symmetry, plan.domain.solids, cell, cells.layout),
        ),
    )


def _cells_and_laws(
    plan: Plan,
    law: ScalingLaw,
    laws: ZoneLaws | None,
    able: Analysable,
    mesh: TetMesh,
    on_event: Listener,
) -> tuple[CellChoice, LawField, tuple[str, ...]]:
    """Cells with their zones, the laws of every tetrahedron, and warnings."""
    cells = CellChoice(
        cell=plan.cell,
        law=law,
        bounds=able.bounds,
        elements_per_wall=able.elements_per_wall,
        layout=plan.layout,
    )
    if laws is None:
        return cells, LawField(laws=(law,)), ()
    centres = centroids(mesh)
    made, warnings = zoning(plan, laws, able, centres, on_event)
    low, high = zone_windows(made, centres)
    bounds = float(low.min()), float(high.max())
    if plan.case.lattice.grading == "uniform":
        # One density for all zones: what all of them allow.
        bounds = float(low.max()), float(high.min())
    return (
        replace(cells, zoning=made, bounds=bounds),
        zoned_laws(made, centres),
        (*laws.warnings, *warnings),
    )


def counted_solid(plan: Plan, bounds: tuple[float, float], mesh: TetMesh) -> FloatArray:
    """Moments ``(10, M)`` of the volume that sizing counts as solid, joints included.

    That of skins and passive regions, s, and of the joints, j, as they are on the lattice of the
    density rho that sizing is expected to choose: ``s + j / (1 - rho)`` of the volume, so that with
    the lattice in the rest the mass is that of all three. A fillet runs along the edge where a wall
    meets the solid, whose length hardly depends on the density. Joints are spread over the room
    that skins and passive regions leave in a tetrahedron.
    """
    domain = plan.domain
    solid = solid_moments(domain, mesh)
    if not adds_to_cells(domain):
        return solid
    design = expected_design(domain, plan.cell, plan.layout, bounds)
    void = 1.0 - expected_density(bounds)
    room = 1.0 - solid_fraction(solid)
    filled = np.minimum(joint_fraction(design, mesh) / void, room)
    share = np.divide(filled, room, out=np.zeros_like(room), where=room > 0)
    return np.asarray(solid + share * (UNIFORM[:, None] - solid))


def _placed_limits(
    plan: Plan,
    homogenised: HomogenisedModel,
    facets: Mapping[str, IntArray],
    kinds: Mapping[str, LimitKind],
) -> tuple[tuple[Limit, ...], tuple[str, ...]]:
    """Limits of a case on the tetrahedra of its part, and their warnings.

    Raises CaseError if tetrahedra are so coarse that the zones around supports leave too little of
    the part or of its lattice to a limit of stress.
    """
    case, zones, space = plan.case, plan.support_zones, homogenised.space
    evaluated = evaluated_at(centroids(space.mesh), zones)
    lattice_volumes = homogenised.lattice_volumes
    if allowed_stress(case.limits, plan.material) is not None:
        bodies = [v for v in (homogenised.volumes, lattice_volumes) if v.any()]
        share = min(float(v @ evaluated) / float(v.sum()) for v in bodies)
        if share < LEAST_JUDGED:
            raise CaseError(
                f"{case.where('part.mesh_size')}: on tetrahedra of {case.part.element_size:.4g} mm "
                f"{share:.0%} of the part or of its lattice is left to the limit of stress outside "
                f"the exclusion radius; expected {LEAST_JUDGED:.0%} at least: take a smaller "
                f"mesh_size or [limits] exclusion_radius"
            )
    nodes = {name: region_nodes(space, on) for name, on in facets.items()}
    return made_limits(
        kinds,
        case.limits,
        PlacedModel(
            where=case.where,
            load_cases=case.load_case,
            material=plan.material,
            law=homogenised.law,
            evaluated=evaluated,
            lattice_volumes=lattice_volumes,
            exclusion_radius=max((zone.radius for zone in zones), default=0.0),
            nodes=nodes,
            shares={name: region_shares(space, on) for name, on in facets.items()},
            supports={load.name: load.supports for load in homogenised.cases},
            solids=_kept_solids(homogenised, nodes),
            filter_radius=case.lattice.filter_radius * plan.layout.typical,
            members=case.lattice.members,
            cells=case.lattice.cells,
        ),
    )


def _kept_solids(part: HomogenisedModel, nodes: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Number of the kept solid of each node of regions, ``(k,)``; -1 where it belongs to none."""
    solid = part.solid_fraction > _KEPT
    number = connected_pieces(part.space, solid)
    number[np.setdiff1d(np.arange(number.size), part.space.elements[:, solid])] = -1
    return {name: number[mine] for name, mine in nodes.items()}
