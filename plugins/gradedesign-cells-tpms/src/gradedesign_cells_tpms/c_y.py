"""The surface C(Y) of Fischer and Koch, complementary to Y; its two sides are one cell, moved.

Not C(+-Y), whose function is that of `pm_y` with the other sign before the cosines.

Raymont's appendix A prints the same function, with the other sign, as "Neovius' Surface"; see
`neovius_as_printed`.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "-sXsYsZ + s2XsY + s2YsZ + sXs2Z - cXcYcZ + s2XcZ + cXs2Y + cYs2Z, "
    "nodal approximation of the surface C(Y)"
)


def c_y(u: FloatArray) -> FloatArray:
    """Nodal function of the surface C(Y).

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    W. Fischer, E. Koch, Z. Kristallogr. 179 (1987) 31 (surface); H. G. von Schnering, R. Nesper, Z.
    Phys. B 83 (1991) 407 (function, as listed by Fisher et al., Data in Brief 49 (2023) 109311); D.
    Raymont, thesis, Univ. Exeter 2011, appendix A (function, under another name).
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    double = sx * cx * (sy + cz) + sy * cy * (sz + cx) + sz * cz * (sx + cy)
    return 2 * double - sx * sy * sz - cx * cy * cz


#: Cells built on this surface.
FAMILIES = surface_families("c-y", c_y, SOURCE)
