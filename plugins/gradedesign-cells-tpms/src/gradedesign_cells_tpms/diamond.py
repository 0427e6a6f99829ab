"""The Schwarz diamond surface; its two sides are the same cell, moved."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "sXsYsZ + sXcYcZ + cXsYcZ + cXcYsZ, nodal approximation of the Schwarz diamond surface"


def diamond(u: FloatArray) -> FloatArray:
    """Nodal function of the Schwarz diamond surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    H. G. von Schnering, R. Nesper, Z. Phys. B 83 (1991) 407, four-term form.
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    return sx * (sy * sz + cy * cz) + cx * (sy * cz + cy * sz)


#: Cells built on this surface.
FAMILIES = surface_families("diamond", diamond, SOURCE)
