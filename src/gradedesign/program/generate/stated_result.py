"""The result record of a lattice of stated density, without the measures of its surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gradedesign.design.case.generate_schema import GenerateCase
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.verdict.common import library_versions
from gradedesign.design.verdict.provenance import material_data
from gradedesign.design.verdict.result import RunResult
from gradedesign.geometry.cell.cells import Cells
from gradedesign.geometry.contour.islands import islands_words
from gradedesign.geometry.lattice.drains import drain_data
from gradedesign.geometry.lattice.joint_volume import joint_volume
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.printed_surface import VOLUME_ERROR
from gradedesign.geometry.lattice.slab_density import SlabDensities, total
from gradedesign.geometry.part.file_body import file_body_data
from gradedesign.geometry.part.part import Part
from gradedesign.mechanics.material.material import Material
from gradedesign.program.generate.density_warnings import BesideCells, density_warnings
from gradedesign.program.generate.generate_files import slab_data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StatedLattice:
    """A lattice as a case states it, before it is made.

    Attributes
    ----------
    part : Part
    cells : Cells
    design : LatticeDesign
    wall : float, mm
        Thinnest wall or strut at the least density.
    report : mapping
        On the map of the cells and their transition, and warnings.
    """

    part: Part
    cells: Cells
    design: LatticeDesign
    wall: float
    report: Mapping[str, Any]


def stated_result(
    request: tuple[GenerateCase, Registry],
    stated: StatedLattice,
    slabs: Sequence[SlabDensities],
    printed: tuple[float, int, float],
    material: Material | None,
) -> RunResult:
    """Result record of a lattice.

    Parameters
    ----------
    request : (GenerateCase, Registry)
    stated : StatedLattice
    slabs : sequence of SlabDensities
        Across x, y and z.
    printed : (float, int, float)
        Volume that is printed, mm^3, how many disconnected components were left out, and their
        share of the volume before.
    material : Material or None
    """
    (case, registry), (volume, dropped, loose) = request, printed
    joints = joint_volume(stated.design)
    beside = BesideCells(
        loose=loose / (1.0 - loose) * volume / stated.part.volume,
        joints=joints / stated.part.volume,
    )
    warnings = (
        *stated.part.report.warnings,
        *registry.notes,
        *stated.report["warnings"],
        *islands_words(dropped, loose),
        *_mix_warnings(stated.report["transition"]),
        *density_warnings(
            case, stated.cells, stated.design.domain, slabs, wall=stated.wall, beside=beside
        ),
    )
    on = slabs[0].measured_on
    density: dict[str, Any] = {
        "target": total(slabs[0], "target"),
        "field": total(slabs[0], "field"),
        on: total(slabs[0], "surface"),
        "slabs": {"xyz"[s.axis]: slab_data(s) for s in slabs},
    }
    heavy, part = None if material is None else material.density, stated.part
    return RunResult(
        status="partial",
        lightest=False,
        reason="generated from a stated density; no analysis was asked for, nothing is proven",
        relative_density=volume / part.volume,
        measures={
            "density": density,
            "cell": _cell_data(case, stated),
            "cell_map": dict(stated.report["cell_map"]),
            "drains": drain_data(stated.design.domain.drains),
            "transition": dict(stated.report["transition"]),
            "volume_mm3": volume,
            "joints_mm3": joints,
        },
        repairs=part.report.changes,
        file_bodies=file_body_data(part.file_bodies),
        warnings=tuple(dict.fromkeys(warnings)),
        plugins=tuple(str(p) for p in registry.plugins),
        versions=library_versions(),
        case_hash=case.case_hash,
        case_name=case.name,
        material={} if material is None else material_data(material),
        mass_g=None if heavy is None else volume * heavy * 1e6,
        solid_mass_g=None if heavy is None else part.volume * heavy * 1e6,
    )


def _cell_data(case: GenerateCase, stated: StatedLattice) -> dict[str, Any]:
    """Plain data on the first cell family."""
    first = stated.cells.members[0]
    return {
        "name": first.name,
        "source": first.family.source,
        "parameters": dict(first.parameters),
        "window": list(stated.cells.window),
        "size_mm": list(case.lattice.size),
        "grading": case.lattice.grading,
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
