"""The cell that cell libraries call lidinoid; its two sides differ.

Its constant shifts the surface between the two sides: see `lidinoid`.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "(s2X cY sZ + s2Y cZ sX + s2Z cX sY) / 2 - (c2Xc2Y + c2Yc2Z + c2Zc2X) / 2 + constant, "
    "the lidinoid of cell libraries with constant 0.15"
)

#: nTop's equation, halved; 0.3 gives that of programs that halve the terms and not the constant.
CONSTANT = 0.15


def lidinoid(u: FloatArray, *, constant: float = CONSTANT) -> FloatArray:
    """Nodal function in use for the lidinoid of Lidin and Larsson.

    Their surface is rhombohedral; this one is cubic and resembles it.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    constant : float
        Of the sheet and the wall. Networks have no use for it: it shifts their level, and at a
        density they are the same.

    Returns
    -------
    (...) array

    References
    ----------
    S. Lidin, S. Larsson, J. Chem. Soc. Faraday Trans. 86 (1990) 769; half of the equation in nTop's
    help, "What equations are used to create the TPMS types?", whose constant 0.3 is then 0.15.
    Programs such as microgen halve the terms and keep 0.3, which is another surface.
    """
    angle = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(angle)
    cx, cy, cz = np.cos(angle)
    xx, yy, zz = 2 * cx * cx - 1, 2 * cy * cy - 1, 2 * cz * cz - 1
    # sin 2X = 2 sin X cos X
    twist = sx * cx * cy * sz + sy * cy * cz * sx + sz * cz * cx * sy
    return np.asarray(twist - (xx * yy + yy * zz + zz * xx) / 2 + constant)


#: Cells built on this surface, whose pores are too narrow for the usual table of distances.
FAMILIES = surface_families(
    "lidinoid",
    lidinoid,
    SOURCE,
    above="-opposite",
    resolution=64,
    parameters={"constant": CONSTANT},
)
