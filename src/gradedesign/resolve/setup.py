"""From a case to everything that does not change from round to round."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.case.locate import locating
from gradedesign.case.schema import Case
from gradedesign.cell.cell import Cell
from gradedesign.cell.local_cells import local_cells
from gradedesign.errors import CaseError, ResourceError, SolverError
from gradedesign.fe.element_points import element_points
from gradedesign.fe.load_case import PartLoadCase, case_loads, region_nodes
from gradedesign.fe.rigid_modes import require_held
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.lattice.domain import DesignDomain, solid_fraction
from gradedesign.layout.cell_layout import CellLayout, layout_warnings
from gradedesign.limits.kinds import made_limits
from gradedesign.limits.limit import Limit, PlacedCase, StatedLimit
from gradedesign.limits.row import LimitRow
from gradedesign.material.material import Material
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.mesh.mesher import Mesher
from gradedesign.mesh.tet_mesh import TetMesh, centroids, signed_volumes
from gradedesign.part.part import Part
from gradedesign.part.part_mesh import (
    box_part_mesh,
    check_region_area,
    mesh_part,
    region_facets,
)
from gradedesign.part.signed_distance import region_distance
from gradedesign.plugin.registry import Registry
from gradedesign.resolve.analysable import analysable_bounds
from gradedesign.resolve.lattice_files import LatticeFile
from gradedesign.resolve.resolve import density_bounds
from gradedesign.resolve.resolve_law import resolve_law
from gradedesign.resolve.resolved_case import resolve_case
from gradedesign.sizing.homogenised_model import HomogenisedModel, homogenised_model
from gradedesign.verify.phases import considered_at
from gradedesign.workspace.progress import Listener, ignore, report_step, stepping


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setup:
    """A case resolved to records, its part meshed, its loads applied.

    Attributes
    ----------
    case : Case
    material : Material
    cell : Cell
    law : ScalingLaw
    bounds : (float, float)
        Intersection of the user's, the family's, the law's and the printer's density windows.
    part : Part
    domain : DesignDomain
    space : TetSpace
        Quadratic tetrahedra of the part.
    facets : dict of region to (k, 3) int array
    model : HomogenisedModel
        Without corrections.
    limits : tuple of Limit
        Those relative to the solid part are resolved by `solid.with_solid`.
    considered : (M,) bool array
        Tetrahedra outside the exclusion radius.
    clamped : tuple of callable
    exclusion_radius : float, mm
    layout : CellLayout
    cubes_per_wall : float
        Grid cubes of the explicit mesh across the thinnest wall.
    frames : callable, optional
        Rotations whose rows cells follow, points ``(3, ...)`` mm to ``(3, 3, ...)``.
    warnings : tuple of str
    solid : tuple of LimitRow
        Every limit with its value on the fully solid part, once that is analysed.
    lattice_files : tuple of LatticeFile
        What is written of the printed lattice.
    """

    case: Case
    material: Material
    cell: Cell
    law: ScalingLaw
    bounds: tuple[float, float]
    part: Part
    domain: DesignDomain
    space: TetSpace
    facets: dict[str, IntArray]
    model: HomogenisedModel
    limits: tuple[Limit, ...]
    considered: BoolArray
    clamped: tuple[Field, ...]
    exclusion_radius: float
    layout: CellLayout
    cubes_per_wall: float
    warnings: tuple[str, ...]
    frames: Field | None = None
    solid: tuple[LimitRow, ...] = ()
    lattice_files: tuple[LatticeFile, ...] = ()


def prepare(case: Case, registry: Registry, on_event: Listener = ignore) -> Setup:
    """Resolve names, read and mesh the part, find its regions, apply its loads."""
    known = resolve_case(case, registry)
    material, cell = known.material, known.cell
    part, domain, layout = known.part, known.domain, known.layout
    with locating(case, "lattice.law"):
        law, law_warnings = resolve_law(
            case,
            registry,
            cell,
            on_event,
            poissons_ratio=material.poissons_ratio,
        )
    bounds, warnings = density_bounds(case, cell, law, layout.least)
    with locating(case, "part.mesh_size"), stepping("meshing the part"):
        mesh = part_tets(case, part, known.mesher)
    report_step("supports, loads and solid shares of the part")
    shares = solid_fraction(domain, mesh)
    volumes = signed_volumes(mesh)
    analysable = analysable_bounds(
        case,
        cell,
        bounds,
        layout.least,
        latticed=float(volumes @ (1 - shares)),
        solid=float(volumes @ shares),
    )
    if analysable.refusal:
        raise ResourceError(analysable.refusal)
    bounds = analysable.bounds
    space = tet_space(mesh, 2)
    facets = part_facets(case, part, mesh, used_regions(case, known.limits))
    clamped_names = sorted({f.region for spec in case.load_case for f in spec.fix})
    clamped = tuple(region_distance(part.regions[name].corners) for name in clamped_names)
    radius = exclusion_radius(case)
    considered = considered_at(centroids(mesh), clamped, radius)
    loads = held_loads(case, space, part, facets)
    model = homogenised_model(
        space,
        shares,
        material,
        law,
        loads,
        rotation=cell_axes(layout, space),
        solver=known.solver,
    )
    limits, limit_warnings = made_limits(
        registry.limits,
        PlacedCase(
            case=case,
            material=material,
            law=law,
            considered=considered,
            lattice_volumes=model.lattice_volumes,
            exclusion_radius=radius,
            nodes={name: region_nodes(space, found) for name, found in facets.items()},
            supports={load.name: load.supports for load in loads},
        ),
    )
    return Setup(
        case=case,
        material=material,
        cell=cell,
        law=law,
        bounds=bounds,
        part=part,
        domain=domain,
        space=space,
        facets=facets,
        model=model,
        limits=limits,
        considered=considered,
        clamped=clamped,
        exclusion_radius=radius,
        layout=layout,
        cubes_per_wall=analysable.cubes_per_wall,
        warnings=(
            *analysable.warnings,
            *(*known.warnings, *law_warnings, *warnings, *limit_warnings),
            *layout_warnings(layout, law.name),
        ),
        lattice_files=known.lattice_files,
    )


def cell_axes(layout: CellLayout, space: TetSpace) -> FloatArray:
    """Rotations of cell axes, ``(3, 3)`` where all cells lie alike, else ``(3, 3, 4, M)``.

    The latter at the Gauss points of the tetrahedra.
    """
    if layout.cell_map.name == "uniform":
        return local_cells(layout.cell_map, space.mesh.points[:, :1]).axes[:, :, 0]
    points = element_points(space).transpose(0, 2, 1)
    axes = local_cells(layout.cell_map, points.reshape(3, -1)).axes
    return axes.reshape(3, 3, *points.shape[1:])


def held_loads(
    case: Case, space: TetSpace, part: Part, facets: Mapping[str, IntArray]
) -> tuple[PartLoadCase, ...]:
    """Supports and forces of every load case, each held against every rigid motion.

    Raises
    ------
    CaseError
        Naming the motions that the supports of a load case leave free.
    """
    loads = case_loads(space, case.load_case, part.regions, facets)
    for number, load_case in enumerate(loads):
        try:
            require_held(space, load_case.supports.fixed, load_case.name)
        except SolverError as error:
            raise CaseError(f"{case.where(f'load_case[{number}].fix')}: {error}") from error
    return loads


def part_tets(case: Case, part: Part, mesher: Mesher) -> TetMesh:
    """Tetrahedra of the part: of bricks for a box that names no mesher, else by the mesher."""
    if case.part.bricks is not None:
        return box_part_mesh(case.part.bricks, case.part.mesh_size)
    return mesh_part(
        part.surface,
        case.part.mesh_size,
        time_limit_s=case.run.time,
        memory_limit_bytes=case.run.memory,
        mesher=mesher,
    ).mesh


def used_regions(case: Case, limits: Sequence[StatedLimit]) -> tuple[str, ...]:
    """Regions that loads, supports or limits speak about."""
    names = {f.region for spec in case.load_case for f in spec.fix}
    names |= {s.region for spec in case.load_case for s in spec.load}
    names |= {limit.region for limit in limits if limit.region}
    return tuple(sorted(names))


def part_facets(case: Case, part: Part, mesh: TetMesh, names: Sequence[str]) -> dict[str, IntArray]:
    """Facets of regions on the part's tetrahedra, with their areas checked."""
    facets = {}
    for name in names:
        region = part.regions[name]
        found = region_facets(mesh, region.corners, tolerance=0.1 * case.part.mesh_size)
        check_region_area(found, region.area, name=name)
        facets[name] = found.facets
    return facets


def exclusion_radius(case: Case) -> float:
    """Radius around clamped regions where stress is not judged, mm."""
    if case.limits.exclusion_radius is not None:
        return case.limits.exclusion_radius
    return (case.limits.exclusion_mesh_sizes or 0.0) * case.part.mesh_size


def part_volume(setup: Setup) -> float:
    """Volume of the part's tetrahedra, mm^3."""
    return float(signed_volumes(setup.space.mesh).sum())
