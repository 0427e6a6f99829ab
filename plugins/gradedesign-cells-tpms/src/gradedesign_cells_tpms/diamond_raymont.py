"""Raymont's diamond with a fourth harmonic: thin networks of rounder struts; its sides differ.

Appendix A prints it as the second "Schwarz W", with a constant of -11 that places the zero close to
the thinnest network. Here the constant is left out, so that the surface is the diamond's and sheet
and wall are about that; the networks do not depend on it.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.diamond import diamond
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "10 (sXsYsZ + sXcYcZ + cXsYcZ + cXcYsZ at X - 45 deg) - 0.7 (c4X + c4Y + c4Z), the second "
    '"Schwarz W" of D. Raymont, thesis, Univ. Exeter 2011, appendix A, plus 11'
)


def diamond_raymont(u: FloatArray) -> FloatArray:
    """Raymont's diamond, without its constant.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    D. Raymont, thesis, Univ. Exeter 2011, appendix A, second "Schwarz W".
    """
    points = np.asarray(u)
    return 10 * diamond(points - 0.125) - 0.7 * np.cos(8 * np.pi * points).sum(axis=0)


#: Cells built on this surface: ``diamond-network-raymont`` is the side it was made for, ``f > 0``.
FAMILIES = surface_families(
    "diamond", diamond_raymont, SOURCE, variant="-raymont", above="", below="-opposite"
)
