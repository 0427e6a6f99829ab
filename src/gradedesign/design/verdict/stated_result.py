"""The result record of a lattice of stated density."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gradedesign.design.acceptance.body import void_warnings
from gradedesign.design.loop.stated_print import StatedPrint, SurfaceMeasures
from gradedesign.design.printing.as_built_body import as_built_data, process_warnings
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.resolve.lattice_files import outer_data
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.stated_lattice import StatedLattice
from gradedesign.design.verdict.common import case_entries
from gradedesign.design.verdict.density_warnings import BesideCells, density_warnings
from gradedesign.design.verdict.printable import thickness_data, with_print_limits
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.contour.islands import islands_words
from gradedesign.geometry.lattice.components.joint import joint_volume
from gradedesign.geometry.lattice.printed_surface import VOLUME_ERROR
from gradedesign.geometry.lattice.slab_density import SlabDensities, total

#: Note in the result in place of the measures of the surface.
_NO_SURFACE = (
    "layers alone are asked for, so no surface was made: thickness, overhangs, islands, closed "
    "voids and the picture are left out; add stl to [output] formats for them"
)


def stated_result(registry: Registry, stated: StatedLattice, made: StatedPrint) -> RunResult:
    """Result record of a lattice; ``not_met`` where it breaks a limit of ``[print.limits]``."""
    case, slabs, volume, surface = stated.case, made.slabs, made.volume, made.surface
    joints, loose = joint_volume(stated.design), made.dropped_share
    beside = BesideCells(
        loose=loose / (1.0 - loose) * volume / stated.part.volume,
        joints=joints / stated.part.volume,
    )
    warnings = (
        *registry.notes,
        *stated.warnings,
        *islands_words(made.dropped, loose),
        *(() if surface is None else surface.islands.filled_words),
        *_mix_warnings(stated.transition),
        *density_warnings(stated, slabs, beside),
        *_surface_warnings(case.print, surface, volume),
        *_process_warnings(stated, surface),
    )
    on = slabs[0].measured_on
    density: dict[str, Any] = {
        "target": total(slabs[0], "target"),
        "field": total(slabs[0], "field"),
        on: total(slabs[0], "surface"),
        "slabs": {"xyz"[s.axis]: _slab_data(s) for s in slabs},
    }
    material, part = stated.material, stated.part
    heavy = None if material is None else material.density
    result = RunResult(
        status="partial",
        lightest=False,
        ended_by="stop_after",
        reason="the lattice of a stated density; nothing is analysed, nothing is proven",
        relative_density=volume / part.volume,
        measures={
            "density": density,
            "cell": {**cell_data(stated), **made.sizes},
            "cell_map": dict(stated.cell_map),
            **stated.design.domain.facts(),
            "transition": dict(stated.transition),
            "volume_mm3": volume,
            "joints_mm3": joints,
            **_loose_data(made),
            **_as_built(stated, surface),
        },
        printed={}
        if surface is None
        else {
            **thickness_data(surface.thickness),
            **outer_data(case.print, case.part.file, part.surface),
        },
        warnings=tuple(dict.fromkeys(warnings)),
        mass_g=None if heavy is None else volume * heavy * 1e6,
        solid_mass_g=None if heavy is None else part.volume * heavy * 1e6,
        **case_entries(case.named, part, material, registry),
    )
    printability = None if surface is None else surface.printability
    return with_print_limits(result, case.print, printability)


def _surface_warnings(
    printer: PrintSpec | None, surface: SurfaceMeasures | None, volume: float
) -> tuple[str, ...]:
    """Warnings on closed voids, of which the check of ``[print]`` says more, or on no surface."""
    if surface is None:
        return (_NO_SURFACE,)
    if printer is not None:
        return ()
    islands = surface.islands
    return tuple(void_warnings(islands.pockets, islands.pocket_volume, volume))


def _process_warnings(stated: StatedLattice, surface: SurfaceMeasures | None) -> tuple[str, ...]:
    """Sentences on what is not known of the process of the case."""
    widths = None if surface is None else surface.thickness.percentiles_mm
    return process_warnings(stated.process, stated.material, widths)


def _as_built(stated: StatedLattice, surface: SurfaceMeasures | None) -> dict[str, Any]:
    """Entry ``as_built`` of the measures; empty without a process."""
    density = None if stated.material is None else stated.material.density
    built = None if surface is None else surface.built
    data = as_built_data(stated.process, built, density)
    return {"as_built": data} if data else {}


def _loose_data(made: StatedPrint) -> dict[str, Any]:
    """Plain data on closed voids of the surface, or on what layers leave out."""
    if made.surface is None:
        return {"disconnected": {"count": made.dropped, "volume_share": made.dropped_share}}
    islands = made.surface.islands
    return {"closed_voids": {"count": islands.pockets, "volume_mm3": islands.pocket_volume}}


def _slab_data(slabs: SlabDensities) -> dict[str, Any]:
    """Plain data of the slabs across one axis."""
    field, surface = slabs.field - slabs.target, slabs.surface - slabs.target
    return {
        "edges_mm": slabs.edges.tolist(),
        "target": slabs.target.tolist(),
        "field": slabs.field.tolist(),
        slabs.measured_on: slabs.surface.tolist(),
        "largest_error_of_field": float(np.abs(field).max()),
        f"largest_error_of_{slabs.measured_on}": float(np.abs(surface).max()),
    }


def cell_data(stated: StatedLattice) -> dict[str, Any]:
    """Plain data on the first cell family."""
    lattice = stated.case.lattice
    first = stated.cells.members[0]
    return {
        "name": first.name,
        "source": first.family.source,
        "parameters": dict(first.parameters),
        "window": list(stated.cells.window),
        "size_mm": list(lattice.size),
        "grading": lattice.grading,
        "thinnest_wall_mm": stated.wall,
    }


def _mix_warnings(transition: Mapping[str, Any]) -> tuple[str, ...]:
    """A warning where a cell of a transition is off its stated density."""
    off = float(transition.get("cell_density_error", 0.0))
    if off <= VOLUME_ERROR:
        return ()
    return (
        f"a cell of the mix is off its stated density by up to {off:.1%}: its share changes "
        "too much within a cell; a transition over more cells mends it",
    )
