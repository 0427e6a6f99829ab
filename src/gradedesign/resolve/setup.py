"""From a case to what its iterations start from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gradedesign.arrays import FloatArray
from gradedesign.case.locate import locating
from gradedesign.case.schema import Case
from gradedesign.errors import ResourceError
from gradedesign.fe.load_case import region_nodes
from gradedesign.fe.space import TetSpace, tet_space
from gradedesign.layout.cell_layout import layout_warnings
from gradedesign.limits.kinds import made_limits
from gradedesign.limits.limit import LimitKind, PlacedCase
from gradedesign.limits.row import LimitRow
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.mesh.tet_mesh import centroids, signed_volumes
from gradedesign.part.signed_distance import region_distance
from gradedesign.plugin.registry import Registry
from gradedesign.resolve.analysable import Analysable
from gradedesign.resolve.cell_choice import CellChoice, cell_axes
from gradedesign.resolve.exclusion import exclusion_radius
from gradedesign.resolve.joint_share import solid_shares
from gradedesign.resolve.part_tets import held_loads, part_facets, part_tets, used_regions
from gradedesign.resolve.problem import Problem
from gradedesign.resolve.resolve import density_bounds
from gradedesign.resolve.resolve_law import resolve_law
from gradedesign.resolve.resolved_case import (
    ResolvedCase,
    analysable_lattice,
    resolve_case,
)
from gradedesign.sizing.homogenised_model import HomogenisedModel, homogenised_model
from gradedesign.verify.analysis import ExplicitAnalysis
from gradedesign.verify.phases import evaluated_at
from gradedesign.workspace.progress import Listener, ignore, report_step, stepping


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
    """

    problem: Problem
    cells: CellChoice
    model: HomogenisedModel
    warnings: tuple[str, ...]
    solid: tuple[LimitRow, ...] = ()


def prepare(case: Case, registry: Registry, on_event: Listener = ignore) -> Setup:
    """Resolve names, read and mesh the part, find its regions, apply its loads."""
    known = resolve_case(case, registry)
    nu = known.material.poissons_ratio
    with locating(case, "lattice.law"):
        law, law_warnings = resolve_law(case, registry, known.cell, on_event, poissons_ratio=nu)
    bounds, narrowed = density_bounds(case, known.cell, law, known.layout.least)
    with locating(case, "part.mesh_size"), stepping("meshing the part"):
        mesh = part_tets(case, known.part, known.mesher)
    report_step("supports, loads and solid volume fractions of the part")
    shares = solid_shares(known, bounds, mesh)
    analysable = affordable(known, bounds, signed_volumes(mesh), shares)
    cells = CellChoice(
        cell=known.cell,
        law=law,
        bounds=analysable.bounds,
        elements_per_wall=analysable.elements_per_wall,
        layout=known.layout,
    )
    problem, limit_warnings = placed_problem(
        known, analysable.analysis, law, tet_space(mesh, 2), shares, registry.limits
    )
    return Setup(
        problem=problem,
        cells=cells,
        model=homogenised_model(
            problem.space,
            shares,
            problem.material,
            law,
            problem.loads,
            rotation=cell_axes(cells.layout, problem.space),
            solver=problem.solver,
        ),
        warnings=(
            *analysable.warnings,
            *(*known.warnings, *law_warnings, *narrowed, *limit_warnings),
            *layout_warnings(cells.layout, law.name),
        ),
    )


def affordable(
    known: ResolvedCase, bounds: tuple[float, float], volumes: FloatArray, shares: FloatArray
) -> Analysable:
    """Density bounds whose lattice the memory of the case can analyse.

    Raises
    ------
    ResourceError
        If no density can be analysed.
    """
    analysable = analysable_lattice(
        known,
        bounds,
        latticed=float(volumes @ (1 - shares)),
        solid=float(volumes @ shares),
    )
    if analysable.refusal:
        raise ResourceError(analysable.refusal)
    return analysable


def placed_problem(
    known: ResolvedCase,
    analysis: ExplicitAnalysis,
    law: ScalingLaw,
    space: TetSpace,
    shares: FloatArray,
    kinds: Mapping[str, LimitKind],
) -> tuple[Problem, tuple[str, ...]]:
    """Loads, supports and limits of a case on the tetrahedra of its part; warnings of limits."""
    case, part, mesh = known.case, known.part, space.mesh
    facets = part_facets(case, part, mesh, used_regions(case, known.limits))
    names = sorted({f.region for spec in case.load_case for f in spec.fix})
    clamped = tuple(region_distance(part.regions[name].corners) for name in names)
    radius = exclusion_radius(case)
    evaluated = evaluated_at(centroids(mesh), clamped, radius)
    loads = held_loads(case, space, part, facets)
    limits, warnings = made_limits(
        kinds,
        PlacedCase(
            case=case,
            material=known.material,
            law=law,
            evaluated=evaluated,
            lattice_volumes=signed_volumes(mesh) * (1 - shares),
            exclusion_radius=radius,
            nodes={name: region_nodes(space, on) for name, on in facets.items()},
            supports={load.name: load.supports for load in loads},
        ),
    )
    problem = Problem(
        case=case,
        material=known.material,
        part=part,
        domain=known.domain,
        space=space,
        solid_fraction=shares,
        facets=facets,
        loads=loads,
        solver=known.solver,
        limits=limits,
        evaluated=evaluated,
        clamped=clamped,
        exclusion_radius=radius,
        analysis=analysis,
        mesher=known.surface_mesher,
        lattice_files=known.lattice_files,
    )
    return problem, warnings
