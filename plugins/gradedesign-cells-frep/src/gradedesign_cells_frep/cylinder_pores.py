"""Cylindrical pores through the cell along all three axes.

``gauge = min_i sqrt(p_j^2 + p_k^2)``; the density is ``1 - 3 pi r^2 + 8 sqrt(2) r^3`` (volume of
three crossing cylinders, Steinmetz).
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.pore_family import Pores, pore_family


def cylinders(p: FloatArray) -> FloatArray:
    """Gauge of three crossing infinite cylinders of radius 1."""
    square = p * p
    # The largest square counts for no cylinder but its own.
    return np.asarray(np.sqrt(np.maximum(square.sum(axis=0) - square.max(axis=0), 0.0)))


#: Cells of this pore.
FAMILIES = tuple(
    pore_family(
        f"cylinder-pores{'-noise' if noise else ''}",
        Pores(gauge=cylinders, mirrored=True),
        symmetry="cubic",
        noise=noise,
        source="cylinders along the axes",
    )
    for noise in (False, True)
)
