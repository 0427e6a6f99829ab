"""The Schwarz diamond surface: sheet, network and constant-thickness wall."""

from __future__ import annotations

from functools import cache

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set

SOURCE = "nodal approximation of the Schwarz diamond surface, sXsYsZ + sXcYcZ + cXsYcZ + cXcYsZ"


def diamond(u: FloatArray) -> FloatArray:
    """Nodal function of the Schwarz diamond surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    H. G. von Schnering, R. Nesper, Z. Phys. B 83 (1991) 407, four-term form.
    """
    x, y, z = 2 * np.pi * np.asarray(u)
    sx, sy, sz = np.sin(x), np.sin(y), np.sin(z)
    cx, cy, cz = np.cos(x), np.cos(y), np.cos(z)
    return sx * (sy * sz + cy * cz) + cx * (sy * cz + cy * sz)


def diamond_sheet(u: FloatArray) -> FloatArray:
    """Absolute nodal value: a level gives a sheet about the surface."""
    return np.abs(diamond(u))


@cache
def _distance() -> Field:
    """Signed distance to the surface, tabulated when first needed."""
    return periodic_distance_to_level_set(diamond)


def diamond_wall(u: FloatArray) -> FloatArray:
    """Distance to the surface, cell units: a level is half of a constant wall thickness."""
    return np.abs(_distance()(u))


#: Cells built on this surface.
FAMILIES = (
    CellFamily(name="diamond-sheet", shape=diamond_sheet, source=f"|f| <= t, {SOURCE}", sides=2),
    CellFamily(name="diamond-network", shape=diamond, source=f"f <= t, {SOURCE}"),
    CellFamily(
        name="diamond-wall",
        shape=diamond_wall,
        source=f"distance to f = 0, {SOURCE}",
        distance=True,
        sides=2,
    ),
)
