"""The Schoen gyroid; its two sides are mirror images of each other."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "sin X cos Y + sin Y cos Z + sin Z cos X, nodal approximation of the Schoen gyroid"


def gyroid(u: FloatArray) -> FloatArray:
    """Nodal function of the Schoen gyroid.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    Ramirez Salazar 2022, eq. 1.14.
    """
    x, y, z = 2 * np.pi * np.asarray(u)
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


#: Cells built on this surface.
FAMILIES = surface_families("gyroid", gyroid, SOURCE)
