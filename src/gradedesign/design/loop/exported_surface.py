"""The surface of a design as its file holds it: extracted, written and read back."""

from __future__ import annotations

import numpy as np

from gradedesign.common.system.progress import report_step
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.resolve.lattice_files import STL_NAME, chord_tolerance, write_printed
from gradedesign.design.resolve.outer_triangles import keeps_outer
from gradedesign.design.resolve.setup import Setup
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.islands import Islands
from gradedesign.geometry.contour.surface import require_closed
from gradedesign.geometry.formats.write_stl import surface_of_stl
from gradedesign.geometry.lattice.printed_surface import printed_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.program.store.run_folder import RunFolder

#: Grid of the exported surface over the surface size of the explicit analysis. Chosen, not
#: measured.
SURFACE_PER_SPACING = 0.5


def export_surface(
    setup: Setup, out: RunFolder, analysed: Analysed
) -> tuple[SurfaceMesh, Islands, str]:
    """Extract the surface, drop islands, write the STL file and read it back.

    Returns
    -------
    surface : SurfaceMesh
        As read back.
    islands : Islands
    sha256 : str
        Of the file.

    Raises
    ------
    LatticeError
        If the surface in the file does not close as it is, or its volume differs from the analysed
        solid's by more than 5 %.
    ResourceError
        If the file that is read back is not the one that was written.
    """
    design, problem = analysed.design, setup.problem
    size = analysed.result.solved.division.surface_size
    step = SURFACE_PER_SPACING * size
    case, part = problem.case, problem.part.surface
    memory, outer = case.run.memory, keeps_outer(case)
    surface, islands, _ = printed_surface(
        design, part, step, chord_tolerance(case), memory=memory, keep_outer=outer
    )
    report_step("writing and reading back the surface")
    digest = write_printed(out, case, part, surface)
    back = surface_of_stl(out.read_bytes(STL_NAME), STL_NAME)
    volume, meshed = require_closed(back), analysed.result.volume
    if not np.isclose(volume, meshed, rtol=0.05):
        raise LatticeError(
            f"the exported surface encloses {volume:.6g} mm^3 but the explicit analysis holds "
            f"{meshed:.6g} mm^3; the explicit grid of {size:.3g} mm is too coarse "
            f"for {setup.cells.cell.name}: raise [run] elements_per_wall"
        )
    return back, islands, digest
