"""A case as far as it is known without a law, a mesh or an analysis: in seconds."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

from gradedesign.arrays import Field
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.printing.as_built_body import StatedProcess, process_warnings
from gradedesign.design.resolve.component_place import component_place
from gradedesign.design.resolve.exclusion import require_judged, zones_of_supports
from gradedesign.design.resolve.expected_design import expected_design
from gradedesign.design.resolve.fitting_part import fitting_part
from gradedesign.design.resolve.lattice_files import require_writable
from gradedesign.design.resolve.load_balance import (
    LoadBalance,
    balance_warnings,
    load_balances,
    open_load_warnings,
    yielding_loads,
)
from gradedesign.design.resolve.planned_law import PlannedLaw
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import (
    case_material,
    case_process,
    planned_densities,
    require_borne,
    require_expansion,
    stated_family,
)
from gradedesign.design.resolve.stated_directions import stated_directions
from gradedesign.design.resolve.symmetry import SymmetryPlane, symmetry_planes
from gradedesign.design.resolve.thin_walls import thin_wall_warnings
from gradedesign.design.resolve.tools import Tools, stated_tools
from gradedesign.design.resolve.weighted_zones import weighted_zones
from gradedesign.design.resolve.zones import ResolvedZone, ResolvedZones, resolve_zones
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.formats.exporter import PlannedPrint
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.component_kind import composed, with_cuts
from gradedesign.geometry.lattice.components.zone import Zones
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.graded_map import require_one_thickness
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.part_room import inner_points, size_warnings
from gradedesign.geometry.lattice.placed_layout import placed_layout
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.limits.kinds import stated_limits
from gradedesign.mechanics.limits.limit import StatedLimit
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.limits.local_stress import allowed_stress
from gradedesign.mechanics.limits.part_buckling import KIND as PART_BUCKLING_KIND
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """A case as far as it is known without a law, a mesh or an analysis."""

    case: Case
    tools: Tools
    material: Material
    process: StatedProcess | None = None  #: That prints it, where the case states it.
    part: Part
    domain: DesignDomain
    cell: Cell
    law: PlannedLaw  #: Not computed.
    layout: CellLayout
    #: Points ``(3, ...)`` mm to tensors ``(3, 3, ...)`` that cells follow once the part is meshed;
    #: None where the case states none, or those of an analysis.
    directions: Field | None = None
    #: Densities that the user, the cell, the law and the printer have in common.
    bounds: tuple[float, float]
    #: Where cells or densities differ; the first of them is what stands here.
    zones: ResolvedZones | None = None
    limits: tuple[StatedLimit, ...]
    support_zones: tuple[SupportZone, ...]  #: In which stress is not judged.
    balances: tuple[LoadBalance, ...]
    symmetry: tuple[SymmetryPlane, ...]
    warnings: tuple[str, ...]  #: Of reading, sizes and loads.
    narrowed: tuple[str, ...]  #: Which window narrowed the user's.

    @property
    def stated_zones(self) -> tuple[ResolvedZone, ...]:
        """Every zone, the first the lattice outside all others; only that one without zones."""
        if self.zones is not None:
            return self.zones.zones
        case = self.case
        return (
            ResolvedZone(
                name="lattice",
                lattice=case.lattice,
                where=case.where,
                cell=self.cell,
                law=self.law,
                bounds=self.bounds,
            ),
        )


def resolve_case(case: Case, registry: Registry) -> Plan:
    """Resolve names, read the part, find its regions, place the cells, intersect the windows.

    Everything that a case can be refused for without computing a law or meshing is refused here.
    Raises `CaseError`, `PartError`, `DensityError`, `LatticeError`, `PluginError`: whatever is
    wrong, with file, line and key. Raises `ResourceError` if the part's mesh or the grid of
    densities cannot fit the memory of the case.
    """
    lattice, zones_of_lattice = weighted_zones(case.lattice)
    if zones_of_lattice:
        case = case.model_copy(update={"lattice": lattice, "zone": zones_of_lattice})
    limits = _buckling_of_cells(case.lattice, case.limits, case.where)
    case = with_acceptance(case.model_copy(update={"limits": limits}))
    plan = _without_zones(case, registry)
    report_step("cells and their zones")
    zones = resolve_zones(
        plan.case,
        registry,
        plan.stated_zones[0],
        plan.domain.of(Zones),
        plan.layout,
        plan.material.poissons_ratio,
    )
    if zones is not None:
        plan = replace(plan, zones=zones, narrowed=(*plan.narrowed, *zones.narrowed))
    require_printable(plan)
    return plan


def require_printable(plan: Plan) -> None:
    """Refuse formats that cannot hold the lattice of a case which writes them.

    Raises `CaseError`.
    """
    case, zones = plan.case, plan.zones
    if case.run.stop_after in ("solid", "sizing"):
        return
    followed = case.lattice.graded_size or case.lattice.orientation is not None
    planned = PlannedPrint(
        axes=plan.cell.axes if zones is None else zones.cells.axes,
        cell_map=None if followed else plan.layout.cell_map,
        domain=plan.domain,
        layer_height=None if case.print is None else case.print.layer_height,
    )
    require_writable(plan.tools.files, planned, case.where)


def _without_zones(case: Case, registry: Registry) -> Plan:
    """The case as if it had no zones."""
    material = case_material(case.material, registry, case.where)
    process = case_process(case.process, case.print, case.limits.judged, registry, case.where)
    yielding = require_borne(case.limits, material, case.where)
    require_expansion(case.load_case, material, case.where)
    family, parameters = stated_family(
        registry, case.where, "lattice", case.lattice.cell, case.lattice.parameters
    )
    tools = stated_tools(case, registry)
    # Reading comes before what may take seconds: a damaged file is found at once.
    case, part = fitting_part(case, registry)
    with locating(case.where, "lattice.cell"):
        cell = calibrate(family, parameters)
    require_one_thickness(case.lattice, case.where, family)
    report_step("distance field and cell map")
    place = component_place(case, part, [cell])
    domain = composed(place, registry.components)
    directions = stated_directions(
        case.lattice.orientation, domain.distance, case.run.memory, registry, case.where
    )
    layout = placed_layout(case.lattice, case.where, part, domain)
    law, bounds, narrowed = planned_densities(
        case.lattice, case.limits, case.print, registry, cell, layout.least, case.where,
        poissons_ratio=material.poissons_ratio,
    )  # fmt: skip
    expected = expected_design(domain, cell, layout, bounds)
    domain = with_cuts(place, registry.components, expected, layout.least)
    balances = load_balances(case.load_case, part, material.density, case.where)
    return Plan(
        case=case,
        tools=tools,
        material=material,
        process=process,
        part=part,
        domain=domain,
        cell=cell,
        law=law,
        layout=layout,
        directions=directions,
        bounds=bounds,
        balances=balances,
        symmetry=symmetry_planes(case.load_case, part, case.where),
        limits=stated_limits(registry.limits, case.limits, case.load_case, material),
        warnings=(
            *case.warnings,
            *yielding,
            *process_warnings(process, material),
            *_shape_warnings(case, part, domain, layout),
            *balance_warnings(balances),
            *yielding_loads(case.load_case, part, balances, material, case.where),
            *_slender_members(case.lattice, case.limits, allowed_stress(case.limits, material)),
            *open_load_warnings(case.load_case, part, domain, layout.typical),
        ),
        narrowed=tuple(narrowed),
        support_zones=_judging_zones(case, part, material, domain, layout),
    )


def _judging_zones(
    case: Case, part: Part, material: Material, domain: DesignDomain, layout: CellLayout
) -> tuple[SupportZone, ...]:
    """Zones around supports; refused where they leave too little to a limit of stress."""
    size, inside = case.part.element_size, inner_points(domain)
    zones = zones_of_supports(case.load_case, case.limits, size, part, inside, layout)
    if allowed_stress(case.limits, material) is not None:
        require_judged(zones, inside, layout.points, case.where)
    return zones


def _shape_warnings(
    case: Case, part: Part, domain: DesignDomain, layout: CellLayout
) -> tuple[str, ...]:
    """Warnings on the part as read, its size and walls, and its components."""
    return (
        *part.report.warnings,
        *size_warnings(case.lattice, case.part, case.where, part),
        *thin_wall_warnings(
            (case.print and case.print.min_wall) or 0.0,
            layout.least if case.lattice.cells else 0.0,
            case.lattice.rotation,
            part,
            domain,
            layout,
            case.where,
        ),
        *domain.notes,
    )


def with_acceptance(case: Case) -> Case:
    """The case with its acceptance: of the plain method, and without cells, whole, unless stated.

    Raises CaseError if it states submodels, which are made of cells, without any.
    """
    if case.lattice.cells and not case.lattice.by_stress:
        return case
    if "acceptance" not in case.run.model_fields_set:
        return case.model_copy(update={"run": case.run.model_copy(update={"acceptance": "whole"})})
    if case.run.acceptance == "submodels" and not case.lattice.cells:
        raise CaseError(
            f"{case.where('run.acceptance')}: submodels are cut around cells, which phases = "
            f'{json.dumps(case.lattice.made)} leave out; expected "whole", or leave it out'
        )
    return case


def _buckling_of_cells(lattice: LatticeSpec, limits: LimitsSpec, where: Where) -> LimitsSpec:
    """The limits; without cells none of them can buckle.

    Raises CaseError if their buckling is limited nevertheless.
    """
    if lattice.cells:
        return limits
    if limits.buckling_factor is not None:
        raise CaseError(
            f"{where('limits.buckling_factor')}: limits the buckling of cells, which phases = "
            f"{json.dumps(lattice.made)} leave out; leave it out too"
        )
    return limits.model_copy(update={"buckling": "off"})


def _slender_members(lattice: LatticeSpec, limits: LimitsSpec, strength: float | None) -> list[str]:
    """A warning where strength is limited but nothing judges whether members buckle."""
    if lattice.cells or strength is None or getattr(limits, PART_BUCKLING_KIND.name, False):
        return []
    return [
        f"stress is limited, but no limit says whether slender members buckle; [limits] "
        f"{PART_BUCKLING_KIND.name} = [{{least = 2.0}}] judges it"
    ]
