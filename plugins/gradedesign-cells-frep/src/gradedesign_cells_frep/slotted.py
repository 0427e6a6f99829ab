"""Plates that stand along z, with slots through which the cells between them open sideways.

Plates of half thickness t: ``d <= t``, with d the distance to their middle planes. Across the
middle of the cell's height runs a slot of height ``slot``, which leaves the material within
``column`` of the lines where plates cross:

    g = max(d, min(slot / 2 - |z - 1/2|, r - column)),

r the distance to the nearest crossing line. As t grows, slots close from all sides by t. Without
slots the solid is prismatic and its void leads along z only, which the calibration refuses: powder
would be locked in between two skins.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.parameters import repeats, within

#: Defaults of the parameters.
PARAMETERS = {"frequency_z": 1.0, "slot": 0.4, "column": 0.1}


def slotted(
    distance: FloatArray,
    crossing: FloatArray,
    z: FloatArray,
    *,
    frequency_z: float,
    slot: float,
    column: float,
) -> FloatArray:
    """Cut slots into plates; see the module.

    Parameters
    ----------
    distance : (...) array, cell units
        To the nearest middle plane of a plate, 0 or more.
    crossing : (...) array, cell units
        To the nearest line where plates cross.
    z : (...) array, cell units
    frequency_z : float
        Rows of slots in a cell, a whole number.
    slot : float, cell units
        Height of the slots at level 0, 0 to 0.9 over the number of rows.
    column : float, cell units
        Half width of the material left at crossing lines at level 0, 0.02 to 0.3.

    Returns
    -------
    (...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.
    """
    rows = repeats("frequency_z", frequency_z)
    height = within("slot", slot, 0.0, 0.9 / rows, "height of the slots in cells")
    radius = within("column", column, 0.02, 0.3, "material left at crossing lines, in cells")
    row = rows * z
    away = np.abs(row - np.floor(row) - 0.5) / rows
    return np.maximum(distance, np.minimum(0.5 * height - away, crossing - radius))
