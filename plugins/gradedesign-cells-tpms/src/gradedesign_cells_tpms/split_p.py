"""The split-P surface; its two sides differ."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "1.1 (s2X cY sZ + s2Y cZ sX + s2Z cX sY) - 0.2 (c2Xc2Y + c2Yc2Z + c2Zc2X) "
    "- 0.4 (c2X + c2Y + c2Z), split P of cell libraries"
)


def split_p(u: FloatArray) -> FloatArray:
    """Nodal function of the split-P surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    nTop's help, "What equations are used to create the TPMS types?".
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    xx, yy, zz = 2 * cx * cx - 1, 2 * cy * cy - 1, 2 * cz * cz - 1
    twist = sx * cx * cy * sz + sy * cy * cz * sx + sz * cz * cx * sy
    return 2.2 * twist - 0.2 * (xx * yy + yy * zz + zz * xx) - 0.4 * (xx + yy + zz)


#: Cells built on this surface.
FAMILIES = surface_families("split-p", split_p, SOURCE, above="-opposite")
