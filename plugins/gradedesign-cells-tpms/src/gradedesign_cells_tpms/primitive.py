"""The Schwarz primitive surface; its two sides are the same cell, moved.

Raymont's appendix A prints it as ``cos X + cos Y + cos Z - 1``. That is this function with another
origin of the level, so its networks are these. It gives no sheet of its own: where it is zero the
necks of the surface have just closed to points.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "cos X + cos Y + cos Z, nodal approximation of the Schwarz primitive surface"


def primitive(u: FloatArray) -> FloatArray:
    """Nodal function of the Schwarz primitive surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    Ramirez Salazar 2022, eq. 1.13; Raymont 2011, eq. 3.13.
    """
    x, y, z = 2 * np.pi * np.asarray(u)
    return np.cos(x) + np.cos(y) + np.cos(z)


#: Cells built on this surface.
FAMILIES = surface_families("primitive", primitive, SOURCE)
