"""The Schwarz primitive surface: sheet, network and constant-thickness wall."""

from __future__ import annotations

from functools import cache

import numpy as np

from gradedesign import CellFamily
from gradedesign.fields import Field, FloatArray, periodic_distance_to_level_set

SOURCE = "nodal approximation of the Schwarz primitive surface, cos X + cos Y + cos Z"


def primitive(u: FloatArray) -> FloatArray:
    """Nodal function of the Schwarz primitive surface.

    Parameters
    ----------
    u : (3, ...) array, cell units, period 1

    Returns
    -------
    (...) array

    References
    ----------
    Ramirez Salazar 2022, eq. 1.13.
    """
    x, y, z = 2 * np.pi * np.asarray(u)
    return np.cos(x) + np.cos(y) + np.cos(z)


def primitive_sheet(u: FloatArray) -> FloatArray:
    """Absolute nodal value: a level gives a sheet about the surface."""
    return np.abs(primitive(u))


@cache
def _distance() -> Field:
    """Signed distance to the surface, tabulated when first needed."""
    return periodic_distance_to_level_set(primitive)


def primitive_wall(u: FloatArray) -> FloatArray:
    """Distance to the surface, cell units: a level is half of a constant wall thickness."""
    return np.abs(_distance()(u))


#: Cells built on this surface.
FAMILIES = (
    CellFamily(
        name="primitive-sheet", shape=primitive_sheet, source=f"|f| <= t, {SOURCE}", sides=2
    ),
    CellFamily(name="primitive-network", shape=primitive, source=f"f <= t, {SOURCE}"),
    CellFamily(
        name="primitive-wall",
        shape=primitive_wall,
        source=f"distance to f = 0, {SOURCE}",
        distance=True,
        sides=2,
    ),
)
