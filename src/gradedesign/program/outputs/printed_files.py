"""Writing the files of the printed lattice into the run folder."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from gradedesign.common.system.atomic import replacing_path
from gradedesign.design.resolve.lattice_files import STL_NAME, LatticeFile
from gradedesign.errors import PluginError, blaming
from gradedesign.geometry.formats.printed_lattice import PrintedLattice
from gradedesign.geometry.formats.write_stl import surface_of_stl, write_stl
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.store.run_folder import RunFolder

log = logging.getLogger(__name__)


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
