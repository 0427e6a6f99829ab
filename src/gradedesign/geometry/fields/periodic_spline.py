"""A function of period 1 by interpolation between the values of a grid."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.ndimage import spline_filter

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import PluginError
from gradedesign.geometry.fields._spline_kernels import linear_values, spline_values
from gradedesign.geometry.fields.compiled_values import compiled_values

Interpolation = Literal["cubic", "linear"]


def periodic_spline(
    values: FloatArray,
    *,
    start: float = 0.0,
    interpolation: Interpolation = "cubic",
    single: bool = False,
) -> Field:
    """Interpolate values of a grid of period 1.

    Parameters
    ----------
    values : (k, l, m) array
        Value i along an axis of n lies at ``(i + start) / n``.
    start : float
        0, or 0.5 for values in the middle of voxels.
    interpolation : {"cubic", "linear"}
        Cubic splines, twice continuously differentiable, or trilinear.
    single : bool
        Keep the table in float32: half the memory to fetch. Only the coefficients are rounded, by
        6e-8 of their size, so the function stays as smooth.

    Returns
    -------
    callable
        Points ``(3, ...)`` in cell units to ``(...)`` of the same float type.

    Raises
    ------
    PluginError
        If the interpolation is unknown, or the values are not those of a grid of points.

    Examples
    --------
    >>> import numpy as np
    >>> nodes = np.stack(np.meshgrid(*[np.arange(16) / 16] * 3, indexing="ij"))
    >>> wave = periodic_spline(np.cos(2 * np.pi * nodes).sum(axis=0))
    >>> float(np.round(wave(np.array([1.5, -3.0, 0.0])), 9))
    1.0
    """
    if interpolation not in ("cubic", "linear"):
        raise PluginError(f"interpolation '{interpolation}' is unknown; use cubic or linear")
    cubic = interpolation == "cubic"
    nodes = np.array(values, dtype=np.float64)
    if nodes.ndim != 3 or nodes.size == 0:
        raise PluginError(
            f"values to interpolate have shape {nodes.shape}, expected those of a grid, (k, l, m)"
        )
    if cubic:
        nodes = spline_filter(nodes, order=3, mode="grid-wrap")
    precision = np.float32 if single else np.float64
    table = np.ascontiguousarray(np.pad(nodes, ((2, 3),) * 3, mode="wrap"), dtype=precision)
    table.flags.writeable = False
    kernel = spline_values if cubic else linear_values

    def evaluate(u: FloatArray) -> FloatArray:
        return compiled_values(kernel, u, table, start)

    return evaluate
