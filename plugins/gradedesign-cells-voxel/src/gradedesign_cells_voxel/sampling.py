"""Evenly spread points of a cell, and checks by them."""

from __future__ import annotations

import numpy as np

from gradedesign import PluginError
from gradedesign.fields import Field, FloatArray

#: Largest difference in density between a cell as given and its table.
VOLUME_TOLERANCE = 0.02

#: Points by which densities are counted.
COUNT = 100_000


def spread(count: int) -> FloatArray:
    """Points that fill the unit cell evenly, ``(3, count)``.

    References
    ----------
    The additive recurrence of a point by powers of 1/x, x^4 = x + 1 (Kronecker sequence).
    """
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.asarray(np.mod(0.5 + step[:, None] * np.arange(count), 1.0))


def require_volume(field: Field, density: float, steps: int) -> None:
    """Refuse a table that lost or gained material.

    Raises
    ------
    PluginError
        If the share of ``field <= 0`` is off by more than `VOLUME_TOLERANCE`.
    """
    fraction = float(np.mean(field(spread(COUNT)) <= 0))
    if abs(fraction - density) > VOLUME_TOLERANCE:
        raise PluginError(
            f"the cell has density {density:.4f}, its table of {steps} steps {fraction:.4f}: its "
            f"walls or pores are too fine for the table; give a higher resolution"
        )
