"""The lattice alone, from a stated density: no sizing, no analysis, no verdict."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gradedesign.arrays import Field
from gradedesign.case.generate_schema import GenerateCase
from gradedesign.cell.calibration import Calibration, calibrate
from gradedesign.cell.cell_map import uniform_map
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import complete_parameters
from gradedesign.cell.wall_size import density_for_wall, wall_mm
from gradedesign.errors import GradeDesignError
from gradedesign.ladder.announce import Announcer
from gradedesign.ladder.files import write_result
from gradedesign.ladder.generate_files import write_generated
from gradedesign.ladder.locate import locating
from gradedesign.ladder.resolve import resolve_material
from gradedesign.ladder.result import RunResult
from gradedesign.ladder.stages import default_folder, open_stages
from gradedesign.ladder.stated_density import stated_density
from gradedesign.ladder.summary import library_versions
from gradedesign.lattice.density_grid import DensityGrid
from gradedesign.lattice.density_source import DensitySource
from gradedesign.lattice.islands import Islands, remove_islands
from gradedesign.lattice.lattice import KeptRegion, LatticeDesign, lattice_field
from gradedesign.lattice.slab_density import SlabDensity, slab_density, total
from gradedesign.lattice.trim import trimmed_surface
from gradedesign.mesh.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.part.part import Part, read_part
from gradedesign.part.signed_distance import region_distance, surface_distance
from gradedesign.plugin.registry import Registry, build_registry, lookup
from gradedesign.workspace.progress import Listener, ignore
from gradedesign.workspace.run_folder import RunFolder

#: Grid steps of the surface along a cell, and across its thinnest wall, at least.
STEPS_PER_CELL, STEPS_PER_WALL = 24.0, 1.5
#: Grid steps along a cell at most.
MOST_STEPS_PER_CELL = 48.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Generated:
    """A lattice of stated density, and what was measured of it.

    Attributes
    ----------
    part : Part
    calibration : Calibration
    design : LatticeDesign
    surface : SurfaceMesh
        What is printed.
    islands : Islands
        Loose pieces that were removed from it.
    slabs : tuple of SlabDensity
        Across x, y and z.
    step : float, mm
        Grid of the surface.
    wall : float, mm
        Thinnest wall or strut at the least density.
    """

    part: Part
    calibration: Calibration
    design: LatticeDesign
    surface: SurfaceMesh
    islands: Islands
    slabs: tuple[SlabDensity, ...]
    step: float
    wall: float


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
        Its status is ``partial``: nothing was analysed. Also written to ``result.json``.

    Raises
    ------
    GradeDesignError
        Whatever was wrong, by name; ``result.json`` then says ``failed``.
    """
    registry = build_registry() if registry is None else registry
    target = default_folder(case) if folder is None else folder
    with open_stages(target, case, resume=False, overwrite=overwrite) as out:
        announce = Announcer(on_event)
        try:
            return _generate(case, registry, out, announce, density)
        except GradeDesignError as error:
            failed = RunResult(
                status="failed",
                lightest=False,
                reason=str(error),
                case_hash=case.case_hash,
                case_name=case.name,
                folder=out.path,
                timing_s=announce.timing(),
            )
            write_result(out, failed)
            raise


def _generate(
    case: GenerateCase,
    registry: Registry,
    out: RunFolder,
    announce: Announcer,
    density: DensitySource | None,
) -> RunResult:
    """The stages in order."""
    with locating(case, "lattice.cell"):
        family: CellFamily = lookup(registry, "cell_families", case.lattice.cell)
    with announce.stage("part"), locating(case, "part.file"):
        part = read_part(case, {s: r.read for r in registry.readers.values() for s in r.suffixes})
    with announce.stage("density"):
        calibration = _calibration(case, family)
        design = _design(case, part, calibration, density)
    with announce.stage("lattice"):
        made = build(case, part, calibration, design)
    slabs = made.slabs[0]
    announce.say(
        "lattice",
        f"{len(made.surface.faces)} triangles at a grid of {made.step:.3g} mm, density "
        f"{total(slabs, 'surface'):.4f} of {total(slabs, 'target'):.4f}",
    )
    result = generated_result(case, registry, made)
    return write_generated(out, case, made.surface, made.slabs, result, announce)


def _calibration(case: GenerateCase, family: CellFamily) -> Calibration:
    with locating(case, "lattice.parameters"):
        parameters = complete_parameters(family, case.lattice.parameters)
    with locating(case, "lattice.cell"):
        return calibrate(family, parameters)


def _design(
    case: GenerateCase, part: Part, calibration: Calibration, source: DensitySource | None
) -> LatticeDesign:
    """The lattice as the case states it."""
    spec, points = case.lattice, part.surface.vertices
    lower, upper = points.min(axis=0), points.max(axis=0)
    distance = surface_distance(part.surface)
    low, high = calibration.window
    if case.print is not None:
        with locating(case, "print.min_wall"):
            floor = density_for_wall(
                calibration.family, calibration.parameters, case.print.min_wall, spec.size
            )
        low = max(low, floor)
    return LatticeDesign(
        part=distance,
        shape=calibration.family.shape,
        level_of=calibration.level_of,
        cell_map=cells(case),
        cell_size=spec.size,
        density=stated_density(
            case,
            source,
            distance=distance,
            lower=lower,
            upper=upper,
            window=(low, high),
            level_of=calibration.level_of,
        ),
        lower=lower,
        upper=upper,
        parameters=calibration.parameters,
        skin=spec.skin,
        kept=tuple(
            KeptRegion(distance=region_distance(part.regions[k.region].corners), margin=k.margin)
            for k in case.keep
        ),
    )


def cells(case: GenerateCase) -> Field:
    """The map from mm to cell coordinates."""
    spec = case.lattice
    rotation = Rotation.from_euler("XYZ", spec.rotation, degrees=True).as_matrix()
    return uniform_map(spec.size, spec.origin, rotation if any(spec.rotation) else None)


def build(
    case: GenerateCase, part: Part, calibration: Calibration, design: LatticeDesign
) -> Generated:
    """Surface of a lattice without loose pieces, and its densities.

    Raises
    ------
    LatticeError
        If there is no solid, or too much of it would be loose.
    """
    size = case.lattice.size
    density = design.density
    least = float(density.values.min()) if isinstance(density, DensityGrid) else density
    wall = float(wall_mm(calibration.family, calibration.parameters, least, size))
    finest = size / MOST_STEPS_PER_CELL
    step = max(min(size / STEPS_PER_CELL, wall / STEPS_PER_WALL), finest)
    raw = trimmed_surface(design, part.surface, step)
    surface, islands = remove_islands(raw, keep=part.report.bodies, least_pocket=(0.5 * step) ** 3)
    field = lattice_field(design, band=3 * step, single=True)
    slabs = tuple(
        slab_density(design, field, surface, part.surface, axis=axis, thickness=size)
        for axis in range(3)
    )
    return Generated(
        part=part,
        calibration=calibration,
        design=design,
        surface=surface,
        islands=islands,
        slabs=slabs,
        step=step,
        wall=wall,
    )


def generated_result(case: GenerateCase, registry: Registry, made: Generated) -> RunResult:
    """What was made, as the result that is written."""
    warnings = [*made.part.report.warnings, *(f"disabled {f}" for f in registry.failures)]
    if made.islands.dropped:
        warnings.append(f"{made.islands.dropped} floating islands were removed")
    slabs = made.slabs[0]
    volume = enclosed_volume(made.surface)
    family = made.calibration.family
    cell: dict[str, Any] = {
        "name": family.name,
        "source": family.source,
        "parameters": dict(made.calibration.parameters),
        "window": list(made.calibration.window),
        "size_mm": case.lattice.size,
        "thinnest_wall_mm": made.wall,
        "grid_mm": made.step,
    }
    density: dict[str, Any] = {what: total(slabs, what) for what in ("target", "field", "surface")}
    density["slabs"] = {"xyz"[s.axis]: slab_data(s) for s in made.slabs}
    heavy = None if case.material is None else resolve_material(case.material, registry).density
    return RunResult(
        status="partial",
        lightest=False,
        reason="generated from a stated density; no analysis was asked for, nothing is proven",
        relative_density=volume / made.part.volume,
        measures={"density": density, "cell": cell, "volume_mm3": volume},
        warnings=tuple(dict.fromkeys(warnings)),
        plugins=tuple(str(p) for p in registry.plugins),
        versions=library_versions(),
        case_hash=case.case_hash,
        case_name=case.name,
        mass_g=None if heavy is None else volume * heavy * 1e6,
        solid_mass_g=None if heavy is None else made.part.volume * heavy * 1e6,
    )


def slab_data(slabs: SlabDensity) -> dict[str, Any]:
    """Plain data of the slabs across one axis."""
    field, surface = slabs.field - slabs.target, slabs.surface - slabs.target
    return {
        "edges_mm": slabs.edges.tolist(),
        "target": slabs.target.tolist(),
        "field": slabs.field.tolist(),
        "surface": slabs.surface.tolist(),
        "largest_error_of_field": float(np.abs(field).max()),
        "largest_error_of_surface": float(np.abs(surface).max()),
    }
