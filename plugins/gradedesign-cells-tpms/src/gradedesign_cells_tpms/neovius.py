"""The Neovius surface; its two sides are the same cell, moved.

Either side falls apart below a density of 0.336.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "3 (cX + cY + cZ) + 4 cXcYcZ, nodal approximation of the Neovius surface"


def neovius(u: FloatArray) -> FloatArray:
    """Nodal function of the Neovius surface, C(P).

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array
        From -13 to 13.

    References
    ----------
    E. R. Neovius, dissertation, Helsinki 1883; H. G. von Schnering, R. Nesper, Z. Phys. B 83
    (1991) 407. Some programs print ``3 cX + cY + cZ + 4 cXcYcZ``, which is not cubic.
    """
    x, y, z = np.cos(2 * np.pi * np.asarray(u))
    return 3 * (x + y + z) + 4 * x * y * z


#: Cells built on this surface.
FAMILIES = surface_families("neovius", neovius, SOURCE)
