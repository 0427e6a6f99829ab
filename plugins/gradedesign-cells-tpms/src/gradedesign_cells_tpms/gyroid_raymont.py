"""Raymont's gyroid with a second harmonic: thin networks of rounder struts; its sides differ."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "10 (cXsY + cYsZ + cZsX) - 0.5 (c2Xc2Y + c2Yc2Z + c2Zc2X), Schoen Gyroid, D. Raymont, thesis, "
    "Univ. Exeter 2011, appendix A"
)


def gyroid_raymont(u: FloatArray) -> FloatArray:
    """Raymont's gyroid.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    D. Raymont, thesis, Univ. Exeter 2011, appendix A.
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    xx, yy, zz = 2 * cx * cx - 1, 2 * cy * cy - 1, 2 * cz * cz - 1
    return 10 * (cx * sy + cy * sz + cz * sx) - 0.5 * (xx * yy + yy * zz + zz * xx)


#: Cells built on this surface: ``gyroid-network-raymont`` is the side it was made for, ``f > 0``.
FAMILIES = surface_families(
    "gyroid", gyroid_raymont, SOURCE, variant="-raymont", above="", below="-opposite"
)
