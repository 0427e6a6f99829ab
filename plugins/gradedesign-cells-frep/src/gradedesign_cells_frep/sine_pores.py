"""Spherical pores replicated by sines, as printed.

Pasko et al. 2009, eq. 9: ``x' = p sin(q x)`` and so on, ``F_r = F_p(x')``. With
``x' = sin(pi q u) / pi``, in spacings, the pore ``|x'| <= r`` is a ball only while it is small; in
general ``pi^2 r^2 = 3/2 - 1/2 sum cos(2 pi q u_i)``: a primitive surface. Neighbours open to each
other at r = 1 / pi, where that surface's void does, at density 1 - 0.2141.
"""

from __future__ import annotations

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep import waves
from gradedesign_cells_frep.parameters import repeats, within


def sine_pores(u: FloatArray, *, frequency: float = 1.0, phase: float = 0.0) -> FloatArray:
    """Shape function, ``-sqrt(sum sin(pi (q u_i - p))^2) / pi``.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    frequency : float
        Pores along the cell, a whole number.
    phase : float
        Shift along each axis, spacings.

    Returns
    -------
    (...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.
    """
    count = repeats("frequency", frequency)
    shift = within("phase", phase, -1.0, 1.0, "spacings of the pores")
    bent = np.sin(np.pi * (count * np.asarray(u) - shift)) / np.pi
    return np.asarray(-np.sqrt((bent * bent).sum(axis=0)))


#: Cells of this pore.
FAMILIES = (
    CellFamily(
        name="sphere-pores-sine",
        shape=sine_pores,
        source=f"{waves.SOURCE}eq. 9 with spheres",
        parameters={"frequency": 1.0, "phase": 0.0},
    ),
)
