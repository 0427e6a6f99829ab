"""The lattice alone, from a stated density: no sizing, no analysis, no verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gradedesign.common.system.progress import Listener, counted, ignore, report_step
from gradedesign.common.values.locate import locating
from gradedesign.design.acceptance.body import void_warnings
from gradedesign.design.case.generate_schema import GenerateCase
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.printing.build_volume import require_fits
from gradedesign.design.printing.print_checks import check_printed, require_voxels_fit
from gradedesign.design.printing.printability import Printability
from gradedesign.design.printing.wall_thickness import WallThickness, wall_thickness
from gradedesign.design.resolve.lattice_files import (
    chord_tolerance,
    lattice_files,
    printed_lattice,
    require_writable,
)
from gradedesign.design.resolve.outer_triangles import keeps_outer, outer_data
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.part_readers import part_readers
from gradedesign.design.resolve.part_repairer import part_repairer
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.resolve import resolve_material
from gradedesign.design.verdict.printable import thickness_data, with_print_limits
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.contour.islands import Islands
from gradedesign.geometry.lattice.density_source import DensitySource
from gradedesign.geometry.lattice.design_domain import design_domain
from gradedesign.geometry.lattice.drains import drain_warnings, drained
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.part_room import require_cells_fit, require_lattice_left
from gradedesign.geometry.lattice.placed_map import lattice_points
from gradedesign.geometry.lattice.printed_surface import first_step, printed_surface
from gradedesign.geometry.lattice.skin_room import require_no_stress, require_struts, skin_warnings
from gradedesign.geometry.lattice.slab_density import SlabDensities, slab_density, total
from gradedesign.geometry.lattice.solid_layers import solid_layers
from gradedesign.geometry.lattice.trim import contour_grid
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.part.part import Part, read_part
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.geometry.triangles.triangle_cells import CellGrid
from gradedesign.mechanics.material.material import Material
from gradedesign.program.generate.generate_files import write_generated
from gradedesign.program.generate.layered import generate_layers, layers_alone
from gradedesign.program.generate.stated_cells import (
    least_density,
    placed_cells,
    stated_cells,
    thinnest_wall,
)
from gradedesign.program.generate.stated_density import stated_density
from gradedesign.program.generate.stated_map import stated_map
from gradedesign.program.generate.stated_result import StatedLattice, stated_result
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.failed import recording_failure
from gradedesign.program.store.run_folder import RunFolder
from gradedesign.program.store.stages import default_folder, open_stages


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Generated:
    """A lattice of stated density with its measures.

    Attributes
    ----------
    design : LatticeDesign
    surface : SurfaceMesh
        What is printed.
    islands : Islands
        Disconnected components that were removed from it.
    slabs : tuple of SlabDensities
        Across x, y and z.
    step : float, mm
        Grid of the surface.
    thickness : WallThickness
        Of the surface.
    printability : Printability or None
        How it is made, where the case has ``[print]``.
    """

    design: LatticeDesign
    surface: SurfaceMesh
    islands: Islands
    slabs: tuple[SlabDensities, ...]
    step: float
    thickness: WallThickness
    printability: Printability | None


def generate(
    case: GenerateCase,
    registry: Registry | None = None,
    *,
    folder: Path | None = None,
    density: DensitySource | None = None,
    on_event: Listener = ignore,
    overwrite: bool = False,
) -> RunResult:
    """Make the lattice that a case states, and write its surface, picture and densities.

    Parameters
    ----------
    case : GenerateCase
        From `load_generate_case`.
    registry : Registry, optional
        The installed cells and readers by default.
    folder : Path, optional
        ``runs/<case name>`` below the working folder by default.
    density : callable, optional
        Points ``(3, n)`` mm to relative density ``(n,)``, in place of the case's density.
    on_event : callable, optional
        Receives every progress event.
    overwrite : bool
        Replace earlier results.

    Returns
    -------
    RunResult
        Its status is ``partial``: nothing was analysed; ``not_met`` where a limit of
        ``[print.limits]`` is broken. Also written to ``result.json``.

    Raises
    ------
    GradeDesignError
        Whatever was wrong, by name; ``result.json`` then says ``failed``.
    """
    registry = with_own_cell(case, build_registry() if registry is None else registry)
    target = default_folder(case) if folder is None else folder
    with open_stages(target, case, resume=False, overwrite=overwrite) as out:
        announce = Announcer(on_event)
        with recording_failure(out, case, registry, announce.timing):
            return _generate(case, registry, out, announce, density)


def _generate(
    case: GenerateCase,
    registry: Registry,
    out: RunFolder,
    announce: Announcer,
    density: DensitySource | None,
) -> RunResult:
    """The stages in order."""
    formats = lattice_files(case, registry)
    mend = part_repairer(case, registry)
    with announce.stage("part"), locating(case.where, "part.file"):
        part = read_part(case, part_readers(case, registry), mend)
    require_fits(case, part.surface)
    require_voxels_fit(case, part.surface)
    require_cells_fit(case, part)
    with announce.stage("density"):
        cells = stated_cells(case, registry)
        design, report = stated_design(case, part, cells, density)
        cell_map = design.cell_map if isinstance(design.cell_map, CellMap) else None
        require_writable(case, formats, design.domain, cell_map, cells.axes)
        wall = thinnest_wall(cells, least_density(design.density), case.lattice.cell_size)
    stated = StatedLattice(part=part, cells=cells, design=design, wall=wall, report=report)
    material = None if case.material is None else resolve_material(case.material, registry)
    if layers_alone(case, formats):
        return generate_layers(case, registry, stated, formats, material, (out, announce))
    with announce.stage("lattice"):
        made = build(case, part, design, wall)
    slabs = made.slabs[0]
    announce.say(
        "lattice",
        f"{len(made.surface.faces)} triangles at a grid of {made.step:.3g} mm, density "
        f"{total(slabs, 'surface'):.4f} of {total(slabs, 'target'):.4f}",
    )
    result = generated_result(case, registry, made, stated, material)
    if joints := result.measures["joints_mm3"]:
        announce.say("lattice", f"joints add {joints:.4g} mm^3")
    result = with_print_limits(result, case, made.printability, material)
    lattice = printed_lattice(case, part.surface, made.surface, made.design, material)
    origin = contour_grid(made.design.domain, made.step).origin
    grid = CellGrid(origin=origin, spacing=made.step)
    return write_generated(out, case, formats, lattice, grid, made.slabs, result, announce)


def stated_design(
    case: GenerateCase, part: Part, cells: Cells, source: DensitySource | None
) -> tuple[LatticeDesign, dict[str, Any]]:
    """The lattice as the case states it."""
    require_no_stress(case)
    domain = design_domain(case, part)
    density = stated_density(
        case, source, domain=domain, window=cells.window, level_of=cells.level_of
    )
    for used in cells.members:
        require_struts(case, used.name, struts=used.axes is not None)
    points = lattice_points(domain)
    require_lattice_left(case, points, domain)
    cell_map, report = stated_map(case, part, cells.members[0], density, domain.distance, points)
    placed, transition = placed_cells(case, cells, cell_map, density=density, domain=domain)
    design = LatticeDesign(
        domain=domain, cells=placed, cell_map=cell_map, cell_size=cell_map.size, density=density
    )
    holes = drained(case, part, design, case.lattice.cell_size)
    design = replace(design, domain=replace(domain, drains=holes.drains))
    warnings = (*skin_warnings(case, part, domain), *drain_warnings(case, holes))
    return design, {"cell_map": report, "transition": transition, "warnings": warnings}


def build(case: GenerateCase, part: Part, design: LatticeDesign, wall: float) -> Generated:
    """Surface of a lattice without disconnected components, and its densities.

    ``wall`` is the thinnest wall or strut, mm.

    Raises
    ------
    LatticeError
        If there is no solid, or too much of it would be disconnected.
    """
    size = case.lattice.cell_size
    surface, islands, step = printed_surface(
        design,
        part.surface,
        first_step(size, wall),
        chord_tolerance(case),
        memory=case.run.memory,
        keep_outer=keeps_outer(case),
    )
    field = lattice_field(design, band=3 * step, single=True)
    thickness = max(size, design.cell_size)
    depth, _ = solid_layers(design.domain, band=3 * step)
    slabs = tuple(
        slab_density(
            *(design, field, surface, part.surface), axis=axis, thickness=thickness, depth=depth
        )
        for axis in counted(range(3), "density by slabs, axis", 3)
    )
    report_step("thickness of the printed solid")
    measured = wall_thickness(surface)
    return Generated(
        design=design,
        surface=surface,
        islands=islands,
        slabs=slabs,
        step=step,
        thickness=measured,
        printability=check_printed(case, part.surface, surface, measured),
    )


def generated_result(
    case: GenerateCase,
    registry: Registry,
    made: Generated,
    stated: StatedLattice,
    material: Material | None,
) -> RunResult:
    """Result record of a generated lattice, as it is written."""
    volume, islands = enclosed_volume(made.surface), made.islands
    printed = (volume, islands.dropped, islands.dropped_share)
    result = stated_result((case, registry), stated, made.slabs, printed, material)
    voids = {"count": islands.pockets, "volume_mm3": islands.pocket_volume}
    told: tuple[str, ...] = ()
    if case.print is None:
        # With [print] the check of printability says more.
        told = void_warnings(islands.pockets, islands.pocket_volume, volume)
    cell = {**result.measures["cell"], "grid_mm": made.step}
    return replace(
        result,
        warnings=(*result.warnings, *told),
        measures={**result.measures, "cell": cell, "closed_voids": voids},
        printed={**thickness_data(made.thickness), **outer_data(case, stated.part.surface)},
    )
