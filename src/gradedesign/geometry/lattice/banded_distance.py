"""Distances that are exact only where needed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.sample import checked_values, grid_points
from gradedesign.geometry.lattice._density_kernels import nearest_bounds


def banded_distance(
    distance: Field,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    spacing: float,
    inner: float,
    outer: float,
) -> Field:
    """Evaluate a distance exactly only where ``-inner <= distance <= outer``.

    A distance changes by at most 1 mm per mm, so its value at the nearest node of a coarse grid
    bounds it. Where the bound settles that a point is outside the band, the bound is returned:
    it has the right sign and lies on the right side of ``-inner`` or ``outer``.

    Returns callable: points ``(3, ...)`` to values ``(...)``. Raises LatticeError if the box or the
    spacing is unusable.

    - ``distance``: a true distance (at most 1 mm per mm), mm
    - ``lower (3,)``, ``upper (3,)``, mm: box covered by the coarse grid; points beyond it are right
      too, only slower
    - ``spacing``, mm: of the coarse grid, which is evaluated here once
    - ``inner``, ``outer``, mm: half widths of the band in which values are exact
    """
    lower, upper = np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)
    if not spacing > 0 or not (upper > lower).all():
        raise LatticeError(f"band over the box {lower} to {upper} mm at {spacing:g} mm is empty")
    x, y, z = (int(n) + 1 for n in np.ceil((upper - lower) / spacing))
    nodes = checked_values(distance, grid_points(lower, (0, 0, 0), (x, y, z), spacing))

    def banded(points: FloatArray) -> FloatArray:
        flat = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(3, -1))
        values, unsure = nearest_bounds(nodes, lower, spacing, flat, inner, outer)
        if unsure:
            exact = np.isnan(values)
            values[exact] = distance(flat[:, exact])
        return values.reshape(points.shape[1:])

    return banded
