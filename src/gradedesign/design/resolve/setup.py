"""Preparation of a case for its iterations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.system.progress import Listener, ignore, report_step, stepping
from gradedesign.common.values.locate import locating
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.analysable import Analysable
from gradedesign.design.resolve.analysable_lattice import analysable_lattice
from gradedesign.design.resolve.cell_choice import CellChoice, cell_axes
from gradedesign.design.resolve.joint_share import moments_with_joints
from gradedesign.design.resolve.part_tets import held_loads, part_facets, part_tets, used_regions
from gradedesign.design.resolve.problem import Problem
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import density_bounds
from gradedesign.design.resolve.resolve_law import resolve_law
from gradedesign.design.resolve.resolved_case import (
    ResolvedCase,
    resolve_case,
)
from gradedesign.design.resolve.stressed_skins import with_stressed_skins
from gradedesign.design.resolve.symmetry import symmetry_planes, symmetry_warnings
from gradedesign.design.resolve.zone_laws import ZoneLaws, zone_laws, zoning
from gradedesign.design.resolve.zoning import zone_windows, zoned_laws
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.cell_layout import layout_warnings
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.explicit.support_zones import evaluated_at
from gradedesign.mechanics.fe.load_case import region_nodes, region_shares
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.space import TetSpace, tet_space
from gradedesign.mechanics.limits.kinds import made_limits
from gradedesign.mechanics.limits.limit import LimitKind, PlacedModel
from gradedesign.mechanics.limits.local_stress import allowed_stress
from gradedesign.mechanics.limits.row import LEAST_JUDGED, LimitRow
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, homogenised_model
from gradedesign.mechanics.sizing.solid_moments import solid_fraction


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setup:
    """A case ready for its iterations.

    Attributes
    ----------
    problem : Problem
        The same in every iteration.
    cells : CellChoice
        Laid out anew for every design where their size is graded.
    model : HomogenisedModel
        Without corrections, in these cells.
    warnings : tuple of str
    solid : tuple of LimitRow
        Every limit with its value on the fully solid part, once that is analysed.
    solutions : tuple of Solution
        Of the fully solid part in every load case, once it is analysed.
    solid_yields : tuple of str
        Warning that the fully solid part yields; empty where it does not.
    """

    problem: Problem
    cells: CellChoice
    model: HomogenisedModel
    warnings: tuple[str, ...]
    solid: tuple[LimitRow, ...] = ()
    solutions: tuple[Solution, ...] = ()
    solid_yields: tuple[str, ...] = ()


def prepare(case: Case, registry: Registry, on_event: Listener = ignore) -> Setup:
    """Resolve names, read and mesh the part, find its regions, apply its loads."""
    resolved = resolve_case(case, registry)
    case, lattice, cell = resolved.case, resolved.case.lattice, resolved.cell
    with locating(case.where, "lattice.law"):
        law, law_warnings = resolve_law(
            lattice, case.limits, registry, cell, case.where, on_event,
            poissons_ratio=resolved.material.poissons_ratio,
        )  # fmt: skip
    least = resolved.layout.least
    bounds, narrowed = density_bounds(lattice, case.print, cell, law, least, case.where)
    laws = zone_laws(resolved, registry, law, on_event)
    with locating(case.where, "part.mesh_size"), stepping("meshing the part"):
        mesh = part_tets(case.part, resolved.part, resolved.mesher, case.run)
    space = tet_space(mesh, 2)
    resolved = with_stressed_skins(resolved, registry.components, space, on_event)
    report_step("supports, loads and solid volume fractions of the part")
    moments = moments_with_joints(resolved, bounds, mesh)
    shares = solid_fraction(moments)
    windows = (bounds,) if laws is None else laws.bounds
    analysable = affordable(resolved, windows, signed_volumes(mesh), shares)
    cells = CellChoice(
        cell=cell,
        law=law,
        bounds=analysable.bounds,
        elements_per_wall=analysable.elements_per_wall,
        layout=resolved.layout,
    )
    field = LawField(laws=(law,))
    zone_warnings: tuple[str, ...] = ()
    if laws is not None:
        cells, field, zone_warnings = with_zones(resolved, cells, laws, analysable, mesh, on_event)
    problem, limit_warnings = placed_problem(
        resolved, analysable.analysis, field, space, shares, registry.limits
    )
    return Setup(
        problem=problem,
        cells=cells,
        model=homogenised_model(
            problem.space,
            shares,
            problem.material,
            field,
            problem.loads,
            rotation=cell_axes(cells.layout, problem.space),
            solver=problem.solver,
            solid_moments=moments,
        ),
        warnings=(
            *analysable.warnings,
            *(*resolved.warnings, *law_warnings, *narrowed, *zone_warnings, *limit_warnings),
            *layout_warnings(cells.layout, law.name),
            *symmetry_warnings(
                symmetry_planes(case.load_case, resolved.part, case.where),
                lattice.skin,
                cell,
                cells.layout,
            ),
        ),
    )


def with_zones(
    resolved: ResolvedCase,
    cells: CellChoice,
    laws: ZoneLaws,
    able: Analysable,
    mesh: TetMesh,
    on_event: Listener,
) -> tuple[CellChoice, LawField, tuple[str, ...]]:
    """Cells with their zones, the laws of every tetrahedron, and warnings."""
    centres = centroids(mesh)
    made, warnings = zoning(resolved, laws, able, centres, on_event)
    low, high = zone_windows(made, centres)
    bounds = float(low.min()), float(high.max())
    if resolved.case.lattice.grading == "uniform":
        # One density for all zones: what all of them allow.
        bounds = float(low.max()), float(high.min())
    return (
        replace(cells, zoning=made, bounds=bounds),
        zoned_laws(made, centres),
        (*laws.warnings, *warnings),
    )


def affordable(
    resolved: ResolvedCase,
    bounds: Sequence[tuple[float, float]],
    volumes: FloatArray,
    shares: FloatArray,
) -> Analysable:
    """Density bounds whose lattice the memory of the case can analyse.

    Raises
    ------
    ResourceError
        If no density can be analysed.
    """
    return analysable_lattice(
        resolved,
        bounds,
        latticed=float(volumes @ (1 - shares)),
        solid=float(volumes @ shares),
    )


def placed_problem(
    resolved: ResolvedCase,
    analysis: ExplicitAnalysis,
    law: LawField,
    space: TetSpace,
    shares: FloatArray,
    kinds: Mapping[str, LimitKind],
) -> tuple[Problem, tuple[str, ...]]:
    """Loads, supports and limits of a case on the tetrahedra of its part; warnings of limits."""
    case, part, mesh = resolved.case, resolved.part, space.mesh
    names = used_regions(case.load_case, resolved.limits)
    facets = part_facets(part, mesh, names, case.part.element_size)
    zones = resolved.support_zones
    evaluated = evaluated_at(centroids(mesh), zones)
    volumes = signed_volumes(mesh)
    if allowed_stress(case.limits, resolved.material) is not None:
        _require_judged(case, evaluated, volumes, volumes * (1 - shares))
    loads = held_loads(case.load_case, space, part, facets, case.where)
    limits, warnings = made_limits(
        kinds,
        case.limits,
        PlacedModel(
            where=case.where,
            load_cases=case.load_case,
            material=resolved.material,
            law=law,
            evaluated=evaluated,
            lattice_volumes=volumes * (1 - shares),
            exclusion_radius=max((zone.radius for zone in zones), default=0.0),
            nodes={name: region_nodes(space, on) for name, on in facets.items()},
            shares={name: region_shares(space, on) for name, on in facets.items()},
            supports={load.name: load.supports for load in loads},
        ),
    )
    problem = Problem(
        case=case,
        material=resolved.material,
        part=part,
        domain=resolved.domain,
        space=space,
        solid_fraction=shares,
        facets=facets,
        loads=loads,
        solver=resolved.solver,
        limits=limits,
        evaluated=evaluated,
        support_zones=zones,
        analysis=analysis,
        mesher=resolved.surface_mesher,
        lattice_files=resolved.lattice_files,
    )
    return problem, warnings


def _require_judged(
    case: Case, evaluated: BoolArray, volumes: FloatArray, lattice_volumes: FloatArray
) -> None:
    """Refuse tetrahedra too coarse for the zones around supports.

    Raises
    ------
    CaseError
        If too little of the part or of its lattice is left to a limit of stress.
    """
    bodies = [v for v in (volumes, lattice_volumes) if v.any()]
    share = min(float(v @ evaluated) / float(v.sum()) for v in bodies)
    if share < LEAST_JUDGED:
        raise CaseError(
            f"{case.where('part.mesh_size')}: on tetrahedra of {case.part.element_size:.4g} mm "
            f"{share:.0%} of the part or of its lattice is left to the limit of stress outside the "
            f"exclusion radius; expected {LEAST_JUDGED:.0%} at least: take a smaller mesh_size or "
            f"[limits] exclusion_radius"
        )
