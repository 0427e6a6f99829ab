"""Ellipsoidal pores, ``gauge = sqrt((x / a)^2 + (y / b)^2 + (z / c)^2)``.

A pore of size r has the half axes a r, b r, c r; up to where they touch the density is
``1 - 4/3 pi a b c r^3``.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign_cells_frep.parameters import within
from gradedesign_cells_frep.pore_family import Pores, pore_family

#: Half axes of the pore of size 1.
AXES = {"axis_x": 1.0, "axis_y": 0.95, "axis_z": 0.9}


def ellipsoid(
    p: FloatArray, *, axis_x: float = 1.0, axis_y: float = 0.95, axis_z: float = 0.9
) -> FloatArray:
    """Gauge of an ellipsoid; its half axes 0.3 to 3.

    Raises
    ------
    CaseError
        If a half axis is out of range.
    """
    total = np.zeros_like(p[0])
    for name, axis, coordinate in zip(AXES, (axis_x, axis_y, axis_z), p, strict=True):
        within(name, axis, 0.3, 3.0, "half axis of the pore of size 1")
        total = total + (coordinate / axis) ** 2
    return np.asarray(np.sqrt(total))


#: Cells of this pore.
FAMILIES = tuple(
    pore_family(
        f"ellipsoid-pores{'-noise' if noise else ''}",
        Pores(gauge=ellipsoid, mirrored=True),
        parameters=AXES,
        symmetry="orthotropic",
        noise=noise,
        source="ellipsoids",
    )
    for noise in (False, True)
)
