"""The surface C(+-Y) of Fischer and Koch; its two sides are the same cell, moved.

Raymont's appendix A prints the same function, with the other sign, as "Neovius' Surface"; see
`neovius_as_printed`.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "-sXsYsZ + s2XsY + s2YsZ + sXs2Z - cXcYcZ + s2XcZ + cXs2Y + cYs2Z, "
    "nodal approximation of the surface C(+-Y)"
)


def c_pm_y(u: FloatArray) -> FloatArray:
    """Nodal function of the surface C(+-Y).

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    E. Koch, W. Fischer, Z. Kristallogr. 183 (1988) 129 (surface); D. Raymont, thesis, Univ. Exeter
    2011, appendix A (function, under another name).
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    double = sx * cx * (sy + cz) + sy * cy * (sz + cx) + sz * cz * (sx + cy)
    return 2 * double - sx * sy * sz - cx * cy * cz


#: Cells built on this surface.
FAMILIES = surface_families("c-pm-y", c_pm_y, SOURCE)
