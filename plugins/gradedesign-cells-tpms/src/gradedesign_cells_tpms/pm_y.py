"""The surface +-Y of Fischer and Koch, "PMY" in cell libraries; its two sides are one cell, moved.

A shift by half a cell along all three axes changes the sign of every term. C(+-Y), which is not
here, has the other sign before the product of cosines.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "2 cXcYcZ + s2XsY + sXs2Z + s2YsZ, nodal approximation of the surface +-Y (PMY)"


def pm_y(u: FloatArray) -> FloatArray:
    """Nodal function of the surface +-Y.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    W. Fischer, E. Koch, Z. Kristallogr. 179 (1987) 31 (surface); H. G. von Schnering, R. Nesper, Z.
    Phys. B 83 (1991) 407 (function, as listed by Fisher et al., Data in Brief 49 (2023) 109311).
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    # sin 2X = 2 sin X cos X
    return 2 * (cx * cy * cz + sx * cx * sy + sx * sz * cz + sy * cy * sz)


#: Cells built on this surface.
FAMILIES = surface_families("pm-y", pm_y, SOURCE)
