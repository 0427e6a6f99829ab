"""The printed lattice in files: the formats a case states, and the part's own triangles."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.locate import Where, locating
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import instead
from gradedesign.design.case.schema import CaseName
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.resolve.registry import Registry, absent
from gradedesign.errors import CaseError, blaming
from gradedesign.geometry.formats.exporter import Exporter, PlannedPrint
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.read_stl import binary_records
from gradedesign.geometry.formats.write_stl import same_triangles
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume
from gradedesign.mechanics.material.material import Material

log = logging.getLogger(__name__)

#: Name of the exported surface that acceptance reads back.
STL_NAME = "lattice.stl"
#: Largest surface that is tested for crossing itself, triangles: about 1 GB is taken.
_MOST_TESTED = 20_000_000
#: Other files of a lattice, whose names no exporter gets.
_TAKEN = ("lattice.png", "lattice.vtu")


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeFile:
    """A file of the printed lattice in one of the case's formats."""

    #: Below the run folder: ``lattice`` and the exporter's suffix; ``lattice-`` and the exporter's
    #: name before it where another file has that name.
    name: str
    exporter: Exporter
    source: str  #: Distribution and version that supplied it.

    @property
    def key(self) -> str:
        """Name of the file in ``files`` of the result."""
        return "stl" if self.name == STL_NAME else f"lattice_{self.exporter.name}"


def lattice_files(
    formats: Sequence[str], registry: Registry, where: Where
) -> tuple[LatticeFile, ...]:
    """Files of the printed lattice for ``[output] formats``, in their order.

    Raises `CaseError` with line and nearest spelling, for a format that nothing installed writes.
    Raises `PluginError`: the same, when a plugin that might have written it is disabled.
    """
    files: list[LatticeFile] = []
    with locating(where, "output.formats"):
        for name in formats:
            if name in registry.outputs:
                continue
            if name not in registry.exporters:
                plugin = supplied_by("exporters", name) or supplied_by("outputs", name)
                near = plugin or instead(name, [*registry.exporters, *registry.outputs])
                raise absent(registry, f"no format named '{name}'; {near}")
            exporter = registry.exporters[name]
            file = f"lattice{exporter.suffix}"
            taken = {*_TAKEN, *(f.name for f in files)} | ({STL_NAME} if name != "stl" else set())
            if file in taken:
                file = f"lattice-{name}{exporter.suffix}"
            source = registry.sources["exporters"][name]
            files.append(LatticeFile(name=file, exporter=exporter, source=source))
    return tuple(files)


def require_writable(files: Sequence[LatticeFile], planned: PlannedPrint, where: Where) -> None:
    """Refuse formats that cannot hold a lattice, before it is made.

    Raises CaseError with file, line, format and reason.
    """
    for file in files:
        with blaming(f"exporter '{file.exporter.name}' of {file.source}", always=False):
            words = file.exporter.refuses(planned)
        if words:
            place, name = where("output.formats"), file.exporter.name
            raise CaseError(f"{place}: the format '{name}' cannot be written: {words}")


def printed_lattice(
    name: CaseName,
    spec: PrintSpec | None,
    surface: SurfaceMesh,
    design: LatticeDesign,
    material: Material | None,
    *,
    part: SurfaceMesh,
    file: Path | None,
) -> PrintedLattice:
    """The record that exporters receive; ``file`` is that of the part."""
    mass = None if material is None else enclosed_volume(surface) * material.density * 1e6

    @cache
    def built() -> Field:
        return lattice_field(design)

    def field(points: FloatArray) -> FloatArray:
        return built()(points)

    return PrintedLattice(
        surface=surface,
        outer_records=outer_records(spec, file, part),
        name=name.name,
        version=metadata.version("gradedesign"),
        case_hash=name.hash,
        material=None if material is None else material.name,
        mass_g=mass,
        field=field,
        design=design,
        bodies=design.domain.bodies,
        layer_height=None if spec is None else spec.layer_height,
        pixel_size=None if spec is None else spec.pixel_size,
        build_direction="+z" if spec is None else spec.build_direction,
        part=part,
    )


def chord_tolerance(spec: PrintSpec | None) -> float | None:
    """Distance within which triangles of the printed surface may be larger, mm."""
    return None if spec is None else spec.chord_tolerance


def crossing_warnings(surface: SurfaceMesh) -> tuple[str, ...]:
    """Warn of triangles of the printed surface that pass through each other.

    Vertices are rounded to float32 first, as files hold them; the steps by which `write_stl` moves
    equal ones apart are far too small to count as a crossing.
    """
    if len(surface.faces) > _MOST_TESTED:
        return (
            f"the printed surface of {len(surface.faces)} triangles is not tested for crossing "
            f"itself, which is done up to {_MOST_TESTED}",
        )
    report_step("triangles that pass through each other")
    vertices = surface.vertices.astype(np.float32).astype(np.float64)
    pairs = crossing_triangles(vertices, surface.faces, TOUCHING)
    if len(pairs) == 0:
        return ()
    at = ", ".join(f"{c:.4g}" for c in vertices[surface.faces[pairs[0, 0]]].mean(axis=0))
    return (
        f"{len(pairs)} triangles of the printed surface pass through others by more than "
        f"{1e3 * TOUCHING:g} um, the first at ({at}) mm; a slicer may fill or drop something there",
    )


def keeps_outer(spec: PrintSpec | None) -> bool:
    """Whether the part's triangles stay as they are in the printed surface."""
    return spec is not None and spec.outer == "cad"


def outer_records(spec: PrintSpec | None, file: Path | None, part: SurfaceMesh) -> bytes:
    """Triangles of the part as its binary STL file in mm holds them, 50 bytes each.

    Empty where they are not kept, and where the file is another one or was mended: the part's
    surface then has their values.
    """
    if not keeps_outer(spec) or file is None:
        return b""
    records = binary_records(file.read_bytes())
    return records if same_triangles(records, corner_points(part)) else b""


def outer_data(spec: PrintSpec | None, file: Path | None, part: SurfaceMesh) -> dict[str, Any]:
    """Plain data on the triangles that are kept; empty where none are."""
    if not keeps_outer(spec):
        return {}
    exactness = "bytes" if outer_records(spec, file, part) else "values"
    return {"outer": {"triangles": len(part.faces), "kept": exactness}}
