"""Solid layers with few elements through them, in words."""

from __future__ import annotations

import numpy as np

from gradedesign.mechanics.explicit.explicit import ExplicitResult
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid

#: Finite cells through a layer with which its dent between walls is known to some 4 %: a plate of
#: 1.5 mm on gyroid sheets of 8 mm, docs/finite-cells.md, "Error estimate".
ENOUGH = 3.0


def coarse_layer(solid: PrintedSolid, result: ExplicitResult) -> str:
    """The thinnest layer of a solid where an analysis has too few elements through it, or nothing.

    Parameters
    ----------
    result : ExplicitResult
        Its finest analysis.

    Returns
    -------
    str
        Such as ``1.4 finite cells of 1.07 mm go through region 'tip', 1.5 mm thick, where 3 are
        enough``.
    """
    components = solid.design.domain.components
    thickness, name = min(((c.least, c.name) for c in components), default=(np.inf, ""))
    if thickness >= ENOUGH * result.mesh_size:
        return ""
    return (
        f"{thickness / result.mesh_size:.1f} finite cells of {result.mesh_size:.3g} mm go through "
        f"{name}, {thickness:.3g} mm thick, where {ENOUGH:g} are enough: a larger [run] "
        f"elements_per_wall takes more"
    )
