"""The map x / L(x), kept only to compare with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.maps.cell_map import CellMap, along, numeric_gradient


def naive_size_map(
    size_of: Field, *, origin: Sequence[float] = (0.0, 0.0, 0.0), step: float, typical: float
) -> CellMap:
    """Map u = (x - origin) / L(x), which published length grading uses.

    Its derivative is ``I / L - (x - origin) grad(L) / L^2``: the farther from the origin, the more
    the cells differ from L, shear and fold. Never used for a design; reports show it beside the
    map of :func:`gradedesign.geometry.maps.phase_fields.graded_size_map`.

    Parameters
    ----------
    size_of : callable
        Points ``(3, ...)`` mm to the size wanted ``(...)``, mm.
    origin : (3,) sequence, mm
    step : float, mm
        Of the central differences that give grad(L).
    typical : float, mm
        Size of a typical cell.

    Returns
    -------
    CellMap

    References
    ----------
    Ramirez Salazar 2022, 3.1.2, which evaluates sin(2 pi x / L(x)).
    """
    start = np.asarray(origin, dtype=np.float64)

    def coordinates(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        return (x - along(start, x)) / size_of(x)

    def jacobian(points: FloatArray) -> FloatArray:
        x = np.asarray(points, dtype=np.float64)
        size = np.asarray(size_of(x))
        slope = numeric_gradient(size_of, x, step)
        u = (x - along(start, x)) / size
        unit = np.eye(3).reshape(3, 3, *[1] * (x.ndim - 1))
        return np.asarray((unit - u[:, None] * slope[None]) / size)

    return CellMap(name="naive", coordinates=coordinates, jacobian=jacobian, size=typical)
