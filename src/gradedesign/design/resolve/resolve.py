"""Records that a case names or states: material, parameters of the cell, densities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gradedesign.common.values.locate import Where, locating
from gradedesign.design.case.material_checks import beyond_yield, beyond_yield_warning
from gradedesign.design.printing.as_built_body import StatedProcess
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.printing.process_schema import ProcessSpec
from gradedesign.design.resolve.planned_law import PlannedLaw, planned_law
from gradedesign.design.resolve.registry import Registry, lookup
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import complete_parameters
from gradedesign.geometry.cell.wall_size import density_for_wall
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.maps.size_law import densities_for_sizes
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.limits.limits_schema import LimitsSpec
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.material_schema import MaterialSpec
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: A density window narrower than this share of its upper end has one density: levels of cells are
#: calibrated to about a thousandth.
_NO_WIDTH = 1e-3


def case_material(spec: MaterialSpec | None, registry: Registry, where: Where) -> Material:
    """Material of a case that is analysed.

    Raises CaseError if there is none, or none of its name.
    """
    if spec is None:
        raise CaseError(f"{where('material')}: missing; an analysis needs [material]")
    with locating(where, "material.name"):
        return resolve_material(spec, registry)


def resolve_material(spec: MaterialSpec, registry: Registry) -> Material:
    """Material of a case: from the library, with what the case states instead."""
    stated: dict[str, Any] = {
        key: value
        for key in (
            "youngs_modulus",
            "poissons_ratio",
            "density",
            "yield_strength",
            "thermal_expansion",
        )
        if (value := getattr(spec, key)) is not None
    }
    if spec.fatigue:
        stated["fatigue"] = tuple(curve.curve() for curve in spec.fatigue)
    if spec.name is not None:
        base: Material = lookup(registry, "materials", spec.name)
        values = {key: getattr(base, key) for key in Material.__dataclass_fields__}
        source = (
            base.source
            if not stated
            else f"{base.source}; stated in the case: " + ", ".join(sorted(stated))
        )
        return Material(**{**values, **stated, "source": source})
    # Reading refuses a safety factor without a yield strength, so nothing asks for a missing one.
    values = {"yield_strength": math.nan, **stated}
    name, source = spec.texts()
    return Material(name=name, source=source, **values)


def case_process(
    spec: ProcessSpec | None,
    printer: PrintSpec | None,
    judged: str | None,
    registry: Registry,
    where: Where,
) -> StatedProcess | None:
    """The process of a case, from the library or stated; None where it has no ``[process]``.

    Raises CaseError if there is none of its name, or what is asked of it is not known of it.

    ``printer``: states the build direction. ``judged``: ``[limits] judged``; both bodies where it
    is not stated and an as-built one is known.
    """
    if spec is None:
        return None
    if spec.name is None:
        process = spec.record("stated" if spec.file is None else spec.file.stem)
    else:
        with locating(where, "process.name"):
            process = lookup(registry, "processes", spec.name)
    unknown = (
        (
            "limits.judged",
            judged in ("as_built", "both") and not process.has_body,
            f'"{judged}", but of process {process.name} neither offset, waviness nor stiffness is '
            f'known, so that it has no as-built body; expected "nominal", or another process',
        ),
        (
            "process.compensate",
            spec.compensate and not (process.strut_size or process.offset),
            f"true, but no offset of process {process.name} is known; leave it out, or name "
            f"another process",
        ),
        (
            "process.variants",
            spec.variants and process.scatter is None and process.waviness is None,
            f"{spec.variants}, but of process {process.name} neither scatter nor waviness is "
            f"known, so that all would be alike; leave it out",
        ),
    )
    for key, wrong, words in unknown:
        if wrong:
            raise CaseError(f"{where(key)}: found {words}")
    return StatedProcess(
        process=process,
        direction="+z" if printer is None else printer.build_direction,
        judged=judged or ("both" if process.has_body else "nominal"),
        compensate=spec.compensate,
        variants=spec.variants,
        seed=spec.seed,
    )


def require_borne(limits: LimitsSpec, material: Material, where: Where) -> tuple[str, ...]:
    """Refuse limits that a material does not allow; a warning of one that the case allows.

    Raises CaseError with file and line: for a stress beyond the strength unless the case states
    ``beyond_yield``.
    """
    strength = material.yield_strength
    if words := beyond_yield(limits, strength, material.youngs_modulus, name=material.name):
        raise CaseError(f"{where('limits.stress')}: {words}")
    for name in limits.lists():
        for number, entry in enumerate(getattr(limits, name)):
            if refused := entry.refusal(material):
                key, words = refused
                raise CaseError(f"{where(f'limits.{name}[{number}].{key}')}: {words}")
    remark = beyond_yield_warning(limits, strength, name=material.name)
    return (remark,) if remark else ()


def require_expansion(load_cases: Sequence[LoadCaseSpec], material: Material, where: Where) -> None:
    """Refuse a temperature change of a material whose thermal expansion is nothing.

    Raises CaseError with file and line.
    """
    for i, load in enumerate(load_cases):
        if load.temperature_change and not material.thermal_expansion:
            raise CaseError(
                f"{where(f'load_case[{i}].temperature_change')}: found "
                f"{load.temperature_change:g} K, but {material.name} has no thermal expansion, so "
                f"that nothing would happen; expected a material that has one, stated as "
                f"thermal_expansion in [material] with the rest of it"
            )


def stated_family(
    registry: Registry, where: Where, table: str, name: str, stated: Mapping[str, float]
) -> tuple[CellFamily, dict[str, float]]:
    """The cell family that a table of a case names, and its parameters with those stated.

    Raises CaseError or PluginError for an unknown family or parameter, with file and line.
    """
    with locating(where, f"{table}.cell"):
        family: CellFamily = lookup(registry, "cell_families", name)
    with locating(where, f"{table}.parameters"):
        return family, complete_parameters(family, stated)


def density_bounds(
    spec: LatticeSpec,
    printer: PrintSpec | None,
    cell: Cell,
    law: ScalingLaw | PlannedLaw | None,
    least_size: float,
    where: Where,
) -> tuple[tuple[float, float], list[str]]:
    """Intersect the density windows and say which one narrowed the user's.

    Nothing is said of the windows of cell and law where the case states no density of its own.

    ``least_size`` is the shortest extent of any cell, mm: its walls must be printable. Without a
    law, or with a planned one, the answer is known before any is computed.

    Raises CaseError if nothing is left, or no density has walls as thick as the printer needs.
    """
    low, high = spec.densities
    windows = {f"cell family '{cell.name}'": cell.window}
    if law is not None:
        windows[f"law '{law.name}'"] = law.window
    silent = set() if "density" in spec.model_fields_set else set(windows)
    if spec.wall is not None:
        sizes = (spec.size[0], spec.size[-1])
        try:
            fitting = densities_for_sizes(cell, spec.wall, sizes)
        except DensityError as error:
            raise CaseError(f"{where('lattice.wall')}: {error}") from error
        windows[f"walls of {spec.wall:g} mm in cells of {spec.size_words}"] = fitting
    elif spec.cells and printer is not None and printer.min_wall is not None:
        if spec.graded_size:
            # Cells are largest where the density is least.
            least_size = spec.size[-1]
        try:
            floor = density_for_wall(cell, printer.min_wall, least_size)
        except DensityError as error:
            raise CaseError(f"{where('print.min_wall')}: {error}") from error
        windows[f"[print] min_wall {printer.min_wall:g} mm"] = (floor, 1.0)
    warnings = []
    for name, (a, b) in windows.items():
        if name not in silent and (a > low + 1e-9 or b < high - 1e-9):
            warnings.append(
                f"density [{low:g}, {high:g}] narrowed to [{max(low, a):.4g}, {min(high, b):.4g}] "
                f"by the window [{a:.4g}, {b:.4g}] of {name}"
            )
        low, high = max(low, a), min(high, b)
    if low > high:
        listed = "; ".join(f"{n}: [{a:.4g}, {b:.4g}]" for n, (a, b) in windows.items())
        raise CaseError(
            f"{where('lattice.density')}: {list(spec.densities)} has nothing in common "
            f"with the windows of what it uses ({listed}); widen it or choose another cell or law"
        )
    if high - low <= _NO_WIDTH * high:
        warnings.append(
            f"{where('lattice.density')}: the density window [{low:.4g}, {high:.4g}] has no "
            f"width: one lattice of that density is judged, and none is looked for; widen it to "
            f"find the lightest"
        )
    return (low, high), warnings


def planned_densities(
    lattice: LatticeSpec,
    limits: LimitsSpec,
    printer: PrintSpec | None,
    registry: Registry,
    cell: Cell,
    least_size: float,
    where: Where,
    *,
    poissons_ratio: float,
) -> tuple[PlannedLaw, tuple[float, float], list[str]]:
    """The law that a cell will have, its densities, and what narrowed the user's.

    Raises `CaseError`, `DensityError` as `density_bounds` and `planned_law`.
    """
    # The window of the cell itself is tested before a law is looked for.
    density_bounds(lattice, printer, cell, None, least_size, where)
    with locating(where, "lattice.law"):
        law = planned_law(lattice, limits, registry, cell, where, poissons_ratio=poissons_ratio)
    return law, *density_bounds(lattice, printer, cell, law, least_size, where)
