"""Schoen's F-RD surface; its two sides differ.

``f > 0`` holds the graph F, twelve struts from every point of a face-centred lattice; ``f < 0``
holds RD, the edges of rhombic dodecahedra. Below a density of 0.33 and 0.22 they fall apart.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = "4 cXcYcZ - (c2Xc2Y + c2Yc2Z + c2Zc2X), nodal approximation of Schoen's F-RD surface"


def frd(u: FloatArray) -> FloatArray:
    """Nodal function of Schoen's F-RD surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array
        From -7 to 2.

    References
    ----------
    A. H. Schoen, NASA TN D-5541 (1970); H. G. von Schnering, R. Nesper, Z. Phys. B 83 (1991) 407.
    """
    x, y, z = np.cos(2 * np.pi * np.asarray(u))
    xx, yy, zz = 2 * x * x - 1, 2 * y * y - 1, 2 * z * z - 1
    return 4 * x * y * z - (xx * yy + yy * zz + zz * xx)


#: Cells built on this surface: ``frd-network`` is the side of RD.
FAMILIES = surface_families("frd", frd, SOURCE, above="-f")
