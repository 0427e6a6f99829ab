"""The surface of a design as its file holds it: extracted, written and read back."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from gradedesign.common.system.progress import report_step
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.resolve.lattice_files import chord_tolerance, keeps_outer, outer_records
from gradedesign.design.resolve.plan import Plan
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.islands import Islands
from gradedesign.geometry.contour.surface import require_closed
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.printed_surface import printed_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Grid of the exported surface over the surface size of the explicit analysis. Chosen, not
#: measured.
_SURFACE_PER_SPACING = 0.5

#: Writes a surface as STL, with triangles of the part as a file holds them; returns it as read
#: back, and the SHA-256 of the file.
WrittenBack: TypeAlias = Callable[[SurfaceMesh, bytes], tuple[SurfaceMesh, str]]


def export_surface(
    plan: Plan, written_back: WrittenBack, analysed: Analysed
) -> tuple[SurfaceMesh, Islands, str]:
    """Extract the surface, drop islands, have it written as STL and read back.

    Raises LatticeError if the surface in the file does not close as it is, or its volume differs
    from the analysed solid's by more than 5 %. Raises ResourceError if the file that is read back
    is not the one that was written. Returns ``surface``: as read back; ``sha256``: of the file.
    """
    size = analysed.result.solved.division.surface_size
    step = _SURFACE_PER_SPACING * size
    case, part = plan.case, plan.part.surface
    surface, islands, _ = case_surface(
        case.print, case.lattice, case.run.memory, part, analysed.design, step
    )
    report_step("writing and reading back the surface")
    back, digest = written_back(surface, outer_records(case.print, case.part.file, part))
    volume, meshed = require_closed(back), analysed.result.volume
    if not np.isclose(volume, meshed, rtol=0.05):
        raise LatticeError(
            f"the exported surface encloses {volume:.6g} mm^3 but the explicit analysis holds "
            f"{meshed:.6g} mm^3; the explicit grid of {size:.3g} mm is too coarse "
            f"for {plan.cell.name}: raise [run] elements_per_wall"
        )
    return back, islands, digest


def case_surface(
    spec: PrintSpec | None,
    lattice: LatticeSpec,
    memory: int,
    part: SurfaceMesh,
    design: LatticeDesign,
    step: float,
) -> tuple[SurfaceMesh, Islands, float]:
    """`printed_surface` as ``[print]`` and ``[lattice]`` ask for it.

    ``memory``, bytes: that it may take. ``step``, mm: of the contour; it may be finer. Returns
    ``step``, mm: at which it was contoured.
    """
    wall = (spec and spec.min_wall) or 0.0
    return printed_surface(
        design,
        part,
        step,
        chord_tolerance(spec),
        memory=memory,
        keep_outer=keeps_outer(spec),
        # Members enclose no void that anybody wants: where they run together nothing drains it.
        least_pore=wall if lattice.cells else max(wall, lattice.least_member or 0.0),
    )
