"""Writing the files of the printed lattice into the run folder."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence

from gradedesign.common.system.atomic import replacing_path
from gradedesign.design.printing.as_built_body import AsBuiltBody
from gradedesign.design.resolve.lattice_files import STL_NAME, LatticeFile
from gradedesign.errors import PluginError, blaming
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.write_stl import surface_of_stl, write_stl
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.store.run_folder import RunFolder

log = logging.getLogger(__name__)

#: Of the file whose built body is the designed one.
COMPENSATED_NAME = "lattice_compensated.stl"
#: Distance from the designed surface, mm, above which a remark tells what compensation leaves: the
#: usual standard deviation of struts. Chosen, not measured.
REMARKED = 0.05


def written_back(out: RunFolder, surface: SurfaceMesh, outer: bytes) -> tuple[SurfaceMesh, str]:
    """Write the printed surface, see `write_printed`; return it as read back, and its SHA-256."""
    digest = write_printed(out, surface, outer)
    return surface_of_stl(out.read_bytes(STL_NAME), STL_NAME), digest


def write_printed(out: RunFolder, surface: SurfaceMesh, outer: bytes) -> str:
    """Write the printed surface as binary STL into the run folder; return its SHA-256.

    ``outer`` are the `outer_records` of the part. Errors are those of `write_stl`.
    """
    digest = write_stl(out.path_of(STL_NAME), surface, outer)
    out.adopt(STL_NAME, digest)
    return digest


def compensated_file(
    out: RunFolder, body: AsBuiltBody | None, files: dict[str, str]
) -> Iterator[str]:
    """Write the surface of which the process builds the designed one; a remark on what is left."""
    if body is None or body.compensated is None:
        return
    write_stl(out.path_of(COMPENSATED_NAME), body.file)
    out.adopt(COMPENSATED_NAME)
    files["compensated"] = COMPENSATED_NAME
    left = body.compensated
    if left.most_mm > REMARKED:
        yield (
            f"{COMPENSATED_NAME}: what process {body.building.process.name} builds of it lies up "
            f"to {left.most_mm:.2g} mm from the designed surface (root mean square "
            f"{left.rms_mm:.2g} mm, 1 % of the vertices farther): features no wider than what the "
            f"process adds to them cannot be compensated"
        )


def write_lattice_files(
    out: RunFolder, files: Sequence[LatticeFile], lattice: PrintedLattice
) -> dict[str, str]:
    """Write the files of a lattice and return their names by what the result calls them.

    Raises `GradeDesignError`: raised by an exporter on purpose, such as for a surface that its
    format cannot hold. Raises `PluginError` if an exporter raises anything else, or leaves anything
    but one file. Raises `CaseError`, `ResourceError` if the file cannot be written.
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
