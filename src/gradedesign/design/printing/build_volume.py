"""Check that a part fits into its printer."""

from __future__ import annotations

import numpy as np

from gradedesign.common.values.direction import FRAMES
from gradedesign.common.values.locate import Where, locating
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.errors import CaseError
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def require_fits(spec: PrintSpec | None, surface: SurfaceMesh, where: Where) -> None:
    """Refuse a part that is larger than ``[print] build_volume`` in its build direction.

    Raises
    ------
    CaseError
        With the extents of the part and the directions in which it would fit.
    """
    if spec is None or spec.build_volume is None:
        return
    room = np.array(spec.build_volume)
    extents = {
        name: np.ptp(surface.vertices @ np.array(frame, dtype=np.float64).T, axis=0)
        for name, frame in FRAMES.items()
    }
    size = extents[spec.build_direction]
    if (size <= room).all():
        return
    fitting = [name for name, extent in extents.items() if (extent <= room).all()]
    advice = f"take build_direction {', '.join(fitting)}" if fitting else "no direction fits"
    with locating(where, "print.build_volume"):
        raise CaseError(
            f"found a part of {' x '.join(f'{s:g}' for s in size)} mm, built towards "
            f"{spec.build_direction}, in {' x '.join(f'{s:g}' for s in room)} mm; expected "
            f"one that fits: {advice}"
        )
