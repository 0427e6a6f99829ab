"""Distance to segments that repeat after several cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gradedesign.fields import Field, FloatArray, near_segments
from gradedesign_cells_stochastic._strut_kernels import least_distance, refine

#: Bins along a cell, first coarse, then split: few of the thousands of struts matter in one.
_COARSE, _SPLIT = 2, 5

#: Every place lies nearer than this to a strut, cells; widened where that does not hold.
_REACH = 0.9


def distance_to_struts(segments: FloatArray, period: int) -> Field:
    """Distance to segments, or to points where both ends coincide, cell units; exact, threaded.

    The core's distance to a graph compares every strut with every bin, and its bins are a
    sixteenth of the period: for the thousand struts of a window both would be slow.

    Parameters
    ----------
    segments : (m, 2, 3) array, cell units
        One of each set of copies.
    period : int, cells

    Returns
    -------
    callable
        Points ``(3, ...)`` to values ``(...)`` of the same float type.
    """
    bins = _COARSE * _SPLIT * period
    rows, first, member = _nearest_by_bin(segments / period, period, _REACH / period)

    def evaluate(u: FloatArray) -> FloatArray:
        points = np.asarray(u) / period
        kind = points.dtype if points.dtype == np.float32 else np.dtype(np.float64)
        flat = np.ascontiguousarray(points.reshape(3, -1), dtype=kind)
        value: FloatArray = np.zeros(flat.shape[1], dtype=kind)
        least_distance(flat, bins, first, member, rows, value)
        value *= period
        return value.reshape(points.shape[1:])

    return evaluate


def _nearest_by_bin(
    segments: FloatArray, period: int, reach: float
) -> tuple[FloatArray, NDArray[np.int64], NDArray[np.int64]]:
    """Rows of copies of segments of period 1, and which may be the nearest in each fine bin."""
    near = near_segments(segments, reach, bins=_COARSE * period)
    bins = near.bins * _SPLIT
    first = np.zeros(bins**3 + 1, dtype=np.int64)
    none = np.zeros(0, dtype=np.int64)
    rows = np.concatenate([near.start, near.axis, near.length[:, None]], axis=1)
    geometry = (near.bins, near.first, near.member, rows, _SPLIT)
    total, widest = refine(*geometry, first, none)
    # All that may be the nearest lie within the least distance at the centre and a diagonal.
    if widest + 3.0**0.5 / bins > reach:
        return _nearest_by_bin(segments, period, 1.5 * reach)
    member = np.zeros(total, dtype=np.int64)
    refine(*geometry, first, member)
    return rows, first, member
