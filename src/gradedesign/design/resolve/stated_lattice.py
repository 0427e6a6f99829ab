"""A lattice of stated density as far as it is known without its surface: in seconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from gradedesign.arrays import Field
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.schema import Case
from gradedesign.design.printing.as_built_body import StatedProcess
from gradedesign.design.resolve.component_place import component_place
from gradedesign.design.resolve.lattice_files import LatticeFile, lattice_files, require_writable
from gradedesign.design.resolve.oriented import alignment, constant_size, oriented_frames
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import case_material, case_process
from gradedesign.design.resolve.stated_cells import (
    least_density,
    placed_cells,
    stated_cells,
    thinnest_wall,
)
from gradedesign.design.resolve.stated_density import stated_density
from gradedesign.design.resolve.stated_directions import stated_directions
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.formats.exporter import PlannedPrint
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.component_kind import composed, with_cuts
from gradedesign.geometry.lattice.components.zone import Zones, require_zones_used
from gradedesign.geometry.lattice.density_grid import DensityGrid
from gradedesign.geometry.lattice.density_source import DensitySource
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.graded_map import require_one_thickness, wanted_size
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.placed_layout import (
    graded_layout,
    lattice_points,
    placed_layout,
)
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.material import Material


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatedLattice:
    """A lattice as a case states it, before its surface is made."""

    case: Case
    part: Part
    cells: Cells  #: Before they are placed.
    design: LatticeDesign
    wall: float  #: mm. Thinnest wall or strut at the least density.
    material: Material | None  #: None where the case names none.
    process: StatedProcess | None  #: That prints it, where the case states it.
    formats: tuple[LatticeFile, ...]  #: Files of the lattice that the case asks for.
    cell_map: Mapping[str, Any]  #: Report on the map of the cells.
    #: Measures of a transition, or of a parameter that changes; else empty.
    transition: Mapping[str, Any]
    warnings: tuple[str, ...]  #: On the case, its part and its lattice.


def stated_lattice(
    case: Case, registry: Registry, part: Part, source: DensitySource | None = None
) -> StatedLattice:
    """The lattice as the case states it; everything that it is refused for is refused here.

    ``source``: points ``(3, n)`` mm to relative density ``(n,)``, in place of the case's density.
    Raises `CaseError`, `DensityError`, `LatticeError`, `PluginError`, `ResourceError`: whatever is
    wrong, with file, line and key.
    """
    formats = lattice_files(case.output.formats, registry, case.where)
    material = None
    if case.material is not None:
        material = case_material(case.material, registry, case.where)
    process = case_process(case.process, case.print, case.limits.judged, registry, case.where)
    report_step("density and cell map")
    cells = stated_cells(case, registry)
    place = component_place(case, part, cells.members)
    domain = composed(place, registry.components)
    density = stated_density(
        case, registry, source, domain=domain, window=cells.window, level_of=cells.level_of
    )
    layout = stated_layout(case, registry, part, cells.members[0], density, domain)
    cell_map = layout.cell_map
    for zones in domain.of(Zones):
        require_zones_used(case.where, zones, layout.points)
    placed, transition = placed_cells(case, cells, cell_map, density=density, domain=domain)
    design = LatticeDesign(
        domain=domain, cells=placed, cell_map=cell_map, cell_size=cell_map.size, density=density
    )
    domain = with_cuts(place, registry.components, design, case.lattice.cell_size)
    design = replace(design, domain=domain)
    planned = PlannedPrint(
        axes=cells.axes,
        cell_map=cell_map,
        domain=design.domain,
        layer_height=None if case.print is None else case.print.layer_height,
    )
    require_writable(formats, planned, case.where)
    return StatedLattice(
        case=case,
        part=part,
        cells=cells,
        design=design,
        wall=thinnest_wall(cells, least_density(design.density), case.lattice.cell_size),
        material=material,
        process=process,
        formats=formats,
        cell_map=layout.report,
        transition=transition,
        warnings=(
            *case.warnings,
            *_unjudged(case.limits, case.where),
            *part.report.warnings,
            *domain.notes,
        ),
    )


def _unjudged(limits: LimitsSpec, where: Where) -> tuple[str, ...]:
    """Say that limits which stand in the case are not judged."""
    if limits.empty:
        return ()
    return (
        f"{where('limits')}: not judged: the density is stated, so the run ends with its "
        f"lattice; `gradedesign judge` judges the file that it writes, and density = [lowest, "
        f"highest] has the lightest one found",
    )


def stated_layout(
    case: Case,
    registry: Registry,
    part: Part,
    cell: Cell,
    density: DensityGrid | float,
    domain: DesignDomain,
) -> CellLayout:
    """Place the cells of a case whose density is stated, and measure them.

    Raises CaseError if the map is impossible, no lattice is left, or the cell has no wall of one
    thickness to grade. Raises LatticeError if the map folds in the part, or the part reaches where
    it cannot be used.

    ``cell``: of the (first) family: graded size follows its walls.
    """
    spec, where, memory = case.lattice, case.where, case.run.memory
    require_one_thickness(spec, where, cell.family)
    tensor_of = stated_directions(spec.orientation, domain.distance, memory, registry, where)
    frames = None if tensor_of is None else oriented_frames(spec, part, tensor_of, where)
    wanted: Field | None = None
    if spec.graded_size and isinstance(density, DensityGrid):
        with locating(where, "lattice.size"):
            ends = (float(density.values.min()), float(density.values.max()))
            wanted = wanted_size(spec, cell, density, ends)
    elif frames is not None:
        wanted = constant_size(spec.edges[0])
    if wanted is None:
        return placed_layout(spec, where, part, domain)
    points = lattice_points(where, domain)
    layout = graded_layout(spec, where, part, points, wanted, frames)
    if tensor_of is None:
        return layout
    turned = alignment(spec.rotation, layout, tensor_of)
    return replace(layout, report={**layout.report, "orientation": turned})
