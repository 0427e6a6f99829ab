"""Check that a shape function repeats after its declared period."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gradedesign.errors import PluginError
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import evaluate_shape, spread_points

#: Points that are compared with their copies. Chosen, not measured.
_POINTS = 300

#: Largest difference between copies, by the range of the values: rounding.
_ROUNDING = 1e-6


def require_period(family: CellFamily, parameters: Mapping[str, float]) -> None:
    """Refuse a shape function that differs between points one period apart.

    Compares values half a period ahead of and behind some hundred points, along each axis.

    Parameters
    ----------
    parameters : mapping of str to float
        Complete.

    Raises
    ------
    PluginError
        Naming the family, the axis, the largest difference and where it was found.
    """
    points = family.period * spread_points(_POINTS)
    for axis in range(3):
        half = np.zeros((3, 1))
        half[axis] = 0.5 * family.period
        ahead = evaluate_shape(family, parameters, points + half)
        behind = evaluate_shape(family, parameters, points - half)
        spread = float(max(ahead.max(), behind.max()) - min(ahead.min(), behind.min()))
        apart = np.abs(ahead - behind)
        worst = int(apart.argmax())
        if apart[worst] > _ROUNDING * spread:
            x, y, z = (points + half)[:, worst]
            scale = "" if family.period == 1 else f" / {family.period}"
            raise PluginError(
                f"cell '{family.name}': values change by {apart[worst]:.3g} over {family.period} "
                f"cell(s) along {'xyz'[axis]}, up to u = ({x:.4g}, {y:.4g}, {z:.4g}), expected at "
                f"most {_ROUNDING * spread:.3g}; the period must be {family.period}, so use "
                f"2 pi u{scale} inside sin and cos, or declare another period"
            )
