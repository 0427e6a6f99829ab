"""Pasko's lattice of rods with smooth set operations and with blends.

``rods-smooth``: the set operations are the R-functions of eq. 3. At level 0 the solid is that of
sharp rods with the threshold given, see `rods`; away from it edges and corners are rounded.

``rods-blended``: to each operation the displacement of eq. 7 is added, which chamfers the edges of
the rods (``edge`` below 0) and fillets the corners where they meet (``fillet`` above 0).
"""

from __future__ import annotations

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep import waves
from gradedesign_cells_frep.parameters import within
from gradedesign_cells_frep.r_functions import displacement, r_and, r_or_of_three

SOURCE = f"{waves.SOURCE}eq. 6 with "

_PLAIN = {"frequency": 1.0, "phase": 0.0, "threshold": 0.5}
_BLENDS = {"edge": -0.2, "fillet": 0.2, "width": 0.5}


def _rods_smooth(
    u: FloatArray, *, frequency: float = 1.0, phase: float = 0.0, threshold: float = 0.5
) -> FloatArray:
    """Shape function of ``rods-smooth``; see the module.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    frequency : float
        Rods in a cell along each axis, a whole number.
    phase : float
        Shift along each axis, periods.
    threshold : float
        Of the slabs at level 0, -0.99 to 0.99: larger ones make thinner rods, which the level
        then thickens, with rounder corners, to the density wanted.

    Returns
    -------
    (...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.
    """
    return rods_blended(
        u, frequency=frequency, phase=phase, threshold=threshold, edge=0.0, fillet=0.0
    )


def rods_blended(
    u: FloatArray,
    *,
    frequency: float = 1.0,
    phase: float = 0.0,
    threshold: float = 0.5,
    edge: float = -0.2,
    fillet: float = 0.2,
    width: float = 0.5,
) -> FloatArray:
    """Shape function of ``rods-blended``; see the module.

    Parameters
    ----------
    u, frequency, phase, threshold
        As in `_rods_smooth`.
    edge, fillet : float
        The paper's a0 of the intersections of slabs and of the union of rods, -1 to 1: negative
        removes material, positive adds it.
    width : float
        The paper's a1 = a2, 0.05 to 2: how far the blends reach, in units of the sine.

    Returns
    -------
    (...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.
    """
    within("edge", edge, -1.0, 1.0, "negative chamfers the edges of rods, positive adds to them")
    within("fillet", fillet, -1.0, 1.0, "positive fills the corners between rods")
    within("width", width, 0.05, 2.0, "how far the blends reach, in units of the sine")
    a, b, c = waves.slab_waves(
        u, frequency=[frequency] * 3, phase=[phase] * 3, threshold=[threshold] * 3
    )
    bars = [r_and(p, q) + displacement(edge, width, p, q) for p, q in ((b, c), (a, c), (a, b))]
    return np.asarray(r_or_of_three(*bars) + displacement(fillet, width, *bars))


#: Cells of this shape.
FAMILIES = (
    CellFamily(
        name="rods-smooth",
        shape=_rods_smooth,
        source=f"{SOURCE}the R-functions of eq. 3",
        parameters=_PLAIN,
    ),
    CellFamily(
        name="rods-blended",
        shape=rods_blended,
        source=f"{SOURCE}the blends of eq. 7",
        parameters={**_PLAIN, **_BLENDS},
    ),
)
