"""The Schoen gyroid: sheet, network and constant-thickness wall."""

from __future__ import annotations

from functools import cache

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set

SOURCE = "nodal approximation of the Schoen gyroid, sin X cos Y + sin Y cos Z + sin Z cos X"


def gyroid(u: FloatArray) -> FloatArray:
    """Nodal function of the Schoen gyroid.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    Ramirez Salazar 2022, eq. 1.14.
    """
    x, y, z = 2 * np.pi * np.asarray(u)
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def gyroid_sheet(u: FloatArray) -> FloatArray:
    """Absolute nodal value: a level gives a sheet about the surface."""
    return np.abs(gyroid(u))


@cache
def _distance() -> Field:
    """Signed distance to the surface, tabulated when first needed."""
    return periodic_distance_to_level_set(gyroid)


def gyroid_wall(u: FloatArray) -> FloatArray:
    """Distance to the surface, cell units: a level is half of a constant wall thickness."""
    return np.abs(_distance()(u))


#: Cells built on this surface.
FAMILIES = (
    CellFamily(name="gyroid-sheet", shape=gyroid_sheet, source=f"|f| <= t, {SOURCE}", sides=2),
    CellFamily(name="gyroid-network", shape=gyroid, source=f"f <= t, {SOURCE}"),
    CellFamily(
        name="gyroid-wall",
        shape=gyroid_wall,
        source=f"distance to f = 0, {SOURCE}",
        distance=True,
        sides=2,
    ),
)
