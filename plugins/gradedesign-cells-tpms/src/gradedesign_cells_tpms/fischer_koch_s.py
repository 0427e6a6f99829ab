"""The surface S of Fischer and Koch; its two sides are the same cell, moved."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "c2X sY cZ + cX c2Y sZ + sX cY c2Z, nodal approximation of the surface S of Fischer, Koch"


def fischer_koch_s(u: FloatArray) -> FloatArray:
    """Nodal function of the surface S.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    W. Fischer, E. Koch, Z. Kristallogr. 179 (1987) 31; H. G. von Schnering, R. Nesper, Z. Phys. B
    83 (1991) 407.
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    return (2 * cx * cx - 1) * sy * cz + cx * (2 * cy * cy - 1) * sz + sx * cy * (2 * cz * cz - 1)


#: Cells built on this surface.
FAMILIES = surface_families("fischer-koch-s", fischer_koch_s, SOURCE)
