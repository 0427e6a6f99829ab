"""A smooth function of period 1 as a cubic spline on a grid."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import spline_filter

from gradedesign.fields import Field, FloatArray
from gradedesign_cells_convolution._convolution_kernels import spline_values


def periodic_spline(function: Field, steps: int) -> Field:
    """Tabulate a function and interpolate it by cubic splines.

    Parameters
    ----------
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``, of period 1.
    steps : int
        Grid steps in a cell.

    Returns
    -------
    callable
        The same for any points, of the same float type; twice continuously differentiable.
    """
    axis = np.arange(steps) / steps
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    coefficients = spline_filter(function(nodes), order=3, mode="grid-wrap")
    table = np.ascontiguousarray(np.pad(coefficients, ((1, 2),) * 3, mode="wrap"))
    table.flags.writeable = False

    def evaluate(u: FloatArray) -> FloatArray:
        points = np.asarray(u)
        kind = points.dtype if points.dtype == np.float32 else np.dtype(np.float64)
        flat = np.ascontiguousarray(points.reshape(3, -1), dtype=kind)
        value: FloatArray = np.zeros(flat.shape[1], dtype=kind)
        spline_values(flat, table, value)
        return value.reshape(points.shape[1:])

    return evaluate
