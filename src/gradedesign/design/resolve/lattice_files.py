"""The files of the printed lattice: the formats that a case states, and writing them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.atomic import replacing_path
from gradedesign.common.system.progress import report_step
from gradedesign.common.values.locate import locating
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.suggest import instead
from gradedesign.design.case.schema import Case
from gradedesign.design.resolve.outer_triangles import outer_records
from gradedesign.design.resolve.registry import Registry, absent
from gradedesign.errors import CaseError, PluginError, blaming
from gradedesign.geometry.cell.strut_axes import StrutAxes
from gradedesign.geometry.formats.exporter import Exporter, PlannedPrint
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.lattice.beams import beam_lattice
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.triangles.crossings import TOUCHING, crossing_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, enclosed_volume
from gradedesign.mechanics.material.material import Material
from gradedesign.program.store.run_folder import RunFolder

log = logging.getLogger(__name__)

#: Name of the exported surface that acceptance reads back.
STL_NAME = "lattice.stl"
#: Largest surface that is tested for crossing itself, triangles: about 1 GB is taken.
MOST_TESTED = 20_000_000
#: Other files of a lattice, whose names no exporter gets.
_TAKEN = ("lattice.png", "lattice.vtu")


@dataclass(frozen=True, slots=True, kw_only=True)
class LatticeFile:
    """A file of the printed lattice in one of the case's formats.

    Attributes
    ----------
    name : str
        Below the run folder: ``lattice`` and the exporter's suffix; ``lattice-`` and the
        exporter's name before it where another file has that name.
    exporter : Exporter
    source : str
        Distribution and version that supplied it.
    """

    name: str
    exporter: Exporter
    source: str

    @property
    def key(self) -> str:
        """Name of the file in ``files`` of the result."""
        return "stl" if self.name == STL_NAME else f"lattice_{self.exporter.name}"


def lattice_files(case: Case, registry: Registry) -> tuple[LatticeFile, ...]:
    """Files of the printed lattice for ``[output] formats``, in their order.

    Raises
    ------
    CaseError
        With line and nearest spelling, for a format that nothing installed writes.
    PluginError
        The same, when a plugin that might have written it is disabled.
    """
    files: list[LatticeFile] = []
    with locating(case.where, "output.formats"):
        for name in case.output.formats:
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


def require_writable(
    case: Case,
    files: Sequence[LatticeFile],
    domain: DesignDomain,
    cell_map: CellMap | None,
    axes: StrutAxes | None,
) -> None:
    """Refuse formats that cannot hold a lattice, before it is made.

    Parameters
    ----------
    case : Case
    files : sequence of LatticeFile
    domain : DesignDomain
    cell_map : CellMap or None
        None where it follows from the design.
    axes : StrutAxes or None
        Of the cell where it is made of struts, and of no other cell beside it.

    Raises
    ------
    CaseError
        With file, line, format and reason.
    """
    planned = PlannedPrint(
        axes=axes,
        cell_map=cell_map,
        domain=domain,
        layer_height=None if case.print is None else case.print.layer_height,
    )
    for file in files:
        with blaming(f"exporter '{file.exporter.name}' of {file.source}", always=False):
            words = file.exporter.refuses(planned)
        if words:
            where = case.where("output.formats")
            raise CaseError(
                f"{where}: the format '{file.exporter.name}' cannot be written: {words}"
            )


def printed_lattice(
    case: Case,
    part: SurfaceMesh,
    surface: SurfaceMesh,
    design: LatticeDesign,
    material: Material | None,
) -> PrintedLattice:
    """The record that exporters receive."""
    mass = None if material is None else enclosed_volume(surface) * material.density * 1e6

    @cache
    def built() -> Field:
        return lattice_field(design)

    def field(points: FloatArray) -> FloatArray:
        return built()(points)

    return PrintedLattice(
        surface=surface,
        outer_records=outer_records(case, part),
        name=case.name,
        version=metadata.version("gradedesign"),
        case_hash=case.case_hash,
        material=None if material is None else material.name,
        mass_g=mass,
        field=field,
        design=design,
        bodies=design.domain.bodies,
        layer_height=None if case.print is None else case.print.layer_height,
        pixel_size=None if case.print is None else case.print.pixel_size,
        build_direction="+z" if case.print is None else case.print.build_direction,
        beams=lambda: beam_lattice(design, part),
    )


def chord_tolerance(case: Case) -> float | None:
    """Distance within which triangles of the printed surface may be larger, mm."""
    return None if case.print is None else case.print.chord_tolerance


def crossing_warnings(surface: SurfaceMesh) -> tuple[str, ...]:
    """Warn of triangles of the printed surface that pass through each other.

    Vertices are rounded to float32 first, as files hold them; the steps by which `write_stl` moves
    equal ones apart are far too small to count as a crossing.
    """
    if len(surface.faces) > MOST_TESTED:
        return (
            f"the printed surface of {len(surface.faces)} triangles is not tested for crossing "
            f"itself, which is done up to {MOST_TESTED}",
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


def write_printed(out: RunFolder, case: Case, part: SurfaceMesh, surface: SurfaceMesh) -> str:
    """Write the printed surface as binary STL into the run folder; return its SHA-256.

    Errors are those of `write_stl`.
    """
    digest = write_stl(out.path_of(STL_NAME), surface, outer_records(case, part))
    out.adopt(STL_NAME, digest)
    return digest


def write_lattice_files(
    out: RunFolder, files: Sequence[LatticeFile], lattice: PrintedLattice
) -> dict[str, str]:
    """Write the files of a lattice and return their names by what the result calls them.

    Raises
    ------
    GradeDesignError
        Raised by an exporter on purpose, such as for a surface that its format cannot hold.
    PluginError
        If an exporter raises anything else, or leaves anything but one file.
    CaseError, ResourceError
        If the file cannot be written.
    """
    for file in files:
        who = f"exporter '{file.exporter.name}' of {file.source} writing {file.name}"
        with replacing_path(out.path_of(file.name)) as path:
            with blaming(who):
                file.exporter.write(path, lattice)
            written = sorted(p.name for p in path.parent.iterdir())
            if written != [path.name] or path.is_symlink() or not path.is_file():
                raise PluginError(
                    f"{who} left {', '.join(written) or 'nothing'}; expected that one file"
                )
            if path.stat().st_size == 0:
                raise PluginError(f"{who} left an empty file")
        out.adopt(file.name)
        log.info("wrote %s by %s of %s", file.name, file.exporter.name, file.source)
    return {file.key: file.name for file in files}
