"""Pasko's lattice of square rods, with sharp edges.

``g = (s_y and s_z) or (s_x and s_z) or (s_x and s_y)`` with
``s_i = sin(2 pi (q u_i + p - 1/4)) - l``, see `waves.slab_waves`. With min and max that is the
median of the three waves, so that one function holds the lattices of all thresholds: the level is
``t = -l``. Rods of width w = 1/2 - asin(l) / pi fill ``3 w^2 - 2 w^3``.

``rods-orthotropic`` has a frequency, a phase and an addition to the threshold for each axis.
"""

from __future__ import annotations

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import FloatArray
from gradedesign_cells_frep import waves

SOURCE = f"{waves.SOURCE}eq. 6 with eq. 2"


def median(values: FloatArray) -> FloatArray:
    """Median of three, ``(3, ...)`` to ``(...)``: union of the intersections of pairs."""
    a, b, c = values
    return np.asarray(np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))


def rods(u: FloatArray, *, frequency: float = 1.0, phase: float = 0.0) -> FloatArray:
    """Shape function; see the module.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1
    frequency : float
        Rods in a cell along each axis, a whole number.
    phase : float
        Shift along each axis, periods.

    Returns
    -------
    (...) array

    Raises
    ------
    CaseError
        If a parameter is out of range.

    Examples
    --------
    >>> float(rods(np.array([0.5, 0.5, 0.0])))
    -1.0
    """
    return median(waves.slab_waves(u, frequency=[frequency] * 3, phase=[phase] * 3))


#: Parameters of rods that differ from axis to axis.
ORTHOTROPIC = {
    **dict.fromkeys(("frequency_x", "frequency_z"), 1.0),
    "frequency_y": 2.0,
    **{f"{kind}_{axis}": 0.0 for kind in ("phase", "threshold") for axis in "xyz"},
}


def _rods_orthotropic(u: FloatArray, **parameters: float) -> FloatArray:
    """Shape function with the parameters `ORTHOTROPIC`; see `rods` and the module.

    The slabs across axis i have the threshold ``threshold_i - t``.
    """
    if unknown := sorted(parameters.keys() - ORTHOTROPIC.keys()):
        raise TypeError(f"rods-orthotropic has no parameter {', '.join(unknown)}")
    values = {**ORTHOTROPIC, **parameters}
    return median(
        waves.slab_waves(
            u,
            **{
                kind: [values[f"{kind}_{axis}"] for axis in "xyz"]
                for kind in ("frequency", "phase", "threshold")
            },
        )
    )


#: Cells of this shape.
FAMILIES = (
    CellFamily(name="rods", shape=rods, source=SOURCE, parameters={"frequency": 1.0, "phase": 0.0}),
    CellFamily(
        name="rods-orthotropic",
        shape=_rods_orthotropic,
        source=SOURCE,
        parameters=ORTHOTROPIC,
        symmetry="orthotropic",
    ),
)
