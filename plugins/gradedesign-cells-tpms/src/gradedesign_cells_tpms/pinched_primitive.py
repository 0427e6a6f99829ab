"""Raymont's pinched primitive surface; its two sides differ.

The thin struts along the axes lie where ``f > 0`` and hold together from a density of 0.074. Up to
0.099 there is a closed pore where three of them meet, so the cell begins there. The other side
falls apart below a density of 0.29.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_tpms.surface_family import surface_families

SOURCE = (
    "-(2.25 (cX + cY + cZ) + 1.25 (cXcY + cYcZ + cZcX)), Primitive (Pinched), D. Raymont, thesis, "
    "Univ. Exeter 2011, appendix A"
)


def pinched_primitive(u: FloatArray) -> FloatArray:
    """Raymont's primitive surface with pinched necks.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array
        From -10.5 to 3.5.

    References
    ----------
    D. Raymont, thesis, Univ. Exeter 2011, appendix A.
    """
    x, y, z = np.cos(2 * np.pi * np.asarray(u))
    return -2.25 * (x + y + z) - 1.25 * (x * y + y * z + z * x)


#: Cells built on this surface: ``pinched-primitive-network`` has the thin struts.
FAMILIES = surface_families(
    "pinched-primitive", pinched_primitive, SOURCE, above="", below="-opposite"
)
