"""Plates across x and y that cross: an egg crate, slotted.

Distance to the plates ``d = 1/2 - max(|x|, |y|)`` and to their crossing lines
``r = |(1/2 - |x|, 1/2 - |y|)|``, from the middle of the cell; slots as in `slotted`. Without slots
the density is ``4 t - 4 t^2``.
"""

from __future__ import annotations

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep.slotted import PARAMETERS, slotted


def slotted_plates(
    u: FloatArray, *, frequency_z: float = 1.0, slot: float = 0.4, column: float = 0.1
) -> FloatArray:
    """Shape function; parameters as in `slotted`."""
    x, y, z = np.asarray(u)
    a, b = (0.5 - np.abs(c - np.floor(c) - 0.5) for c in (x, y))
    return slotted(
        np.minimum(a, b), np.hypot(a, b), z, frequency_z=frequency_z, slot=slot, column=column
    )


#: Cells of this shape.
FAMILIES = (
    CellFamily(
        name="slotted-plates",
        shape=slotted_plates,
        source="crossing plates with slots, elementary geometry",
        parameters=PARAMETERS,
        symmetry="tetragonal",
        distance=True,
        sides=2,
    ),
)
