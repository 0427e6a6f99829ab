"""Raymont's "Neovius' Surface", which is C(Y): the name as printed, for work that quotes it.

The true one is in `neovius`. The solid of the network is where the printed function is positive.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.c_y import c_y
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    '"Neovius\' Surface" as printed in D. Raymont, thesis, Univ. Exeter 2011, appendix A: '
    "-(-sXsYsZ + s2XsY + s2YsZ + sXs2Z - cXcYcZ + s2XcZ + cXs2Y + cYs2Z), which is C(Y)"
)


def neovius_as_printed(u: FloatArray) -> FloatArray:
    """Function that Raymont's appendix A prints for the Neovius surface: minus C(Y).

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array
    """
    return np.negative(c_y(u))


#: Cells built on this surface.
FAMILIES = surface_families(
    "neovius", neovius_as_printed, SOURCE, variant="-as-printed", below=None, above=""
)
