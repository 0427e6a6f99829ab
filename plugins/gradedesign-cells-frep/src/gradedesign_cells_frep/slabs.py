"""Slabs across all three axes, opened by tunnels.

Pasko's slabs ``sin(2 pi (q u_i + p - 1/4)) >= l``, placed as in `waves.slab_waves`, are
``d_i <= t`` with d_i the distance to their middle planes and ``l = cos(2 pi q t)``. Their union
alone is a block of closed boxes; less the square tunnels ``d_j, d_k >= t + web`` through the boxes
along each axis it is open:

    g = max(min_i d_i, median_i d_i - web).

With ``W(t) = 2 q t`` the density is ``1 - (1 - W(t))^3 - 3 W(t) (1 - W(t + web))^2``. The level is
half of the slabs' thickness; a web of 0 leaves rods.
"""

from __future__ import annotations

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep import waves
from gradedesign_cells_frep.parameters import repeats, within
from gradedesign_cells_frep.rods import median

PARAMETERS = {"frequency": 1.0, "phase": 0.0, "web": 0.15}


def slabs(
    u: FloatArray, *, frequency: float = 1.0, phase: float = 0.0, web: float = 0.15
) -> FloatArray:
    """Shape function; see the module.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    frequency : float
        Slabs in a cell along each axis, a whole number.
    phase : float
        Shift of the slabs along each axis, periods.
    web : float, cell units
        Width of the frame that stands out of each slab's edges around the tunnels, 0 to 0.45 over
        the frequency.

    Returns
    -------
    (...) array, cell units

    Raises
    ------
    CaseError
        If a parameter is out of range.

    Examples
    --------
    >>> round(float(slabs(np.array([0.5, 0.6, 0.6]))), 6)
    0.0
    """
    count = repeats("frequency", frequency)
    shift = within("phase", phase, -1.0, 1.0, "periods of the slabs")
    frame = within("web", web, 0.0, 0.45 / count, "the frame around the tunnels in cells")
    place = count * np.asarray(u) + (shift - 0.5)
    d = np.abs(place - np.round(place)) / count
    return np.asarray(np.maximum(d.min(axis=0), median(d) - frame))


#: Cells of this shape.
FAMILIES = (
    CellFamily(
        name="slabs",
        shape=slabs,
        source=f"{waves.SOURCE}eqs. 4 and 1: slabs less tunnels",
        parameters=PARAMETERS,
        distance=True,
        sides=2,
    ),
)
