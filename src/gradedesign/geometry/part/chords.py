"""Distances from points inside a closed surface to that surface along three directions."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray

#: Points this far outside a triangle, over its size, count as on it: rays through an edge hit.
_EDGE = 1e-9
#: Boxes along each side of the table that tells which triangles cover no point. Chosen, not
#: measured.
_BOXES = 256


def chords(
    corners: FloatArray, points: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distance from points to the nearest crossing of a surface, backward and forward.

    Parameters
    ----------
    corners : (m, 3, 3) array, mm
        Corners of triangles.
    points : (3, n) array, mm
    axes : (3, 3) array
        Columns are orthonormal directions.

    Returns
    -------
    backward, forward : (3, n) array, mm
        By direction; infinite where nothing is crossed.
    """
    triangles = np.asarray(corners, dtype=np.float64) @ axes
    places = axes.T @ np.asarray(points, dtype=np.float64)
    backward = np.full(places.shape, np.inf)
    forward = np.full(places.shape, np.inf)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        order = np.argsort(places[i], kind="stable")
        a, b, height = places[i][order], places[j][order], places[k][order]
        first = np.searchsorted(a, triangles[:, :, i].min(axis=1), side="left")
        last = np.searchsorted(a, triangles[:, :, i].max(axis=1), side="right")
        behind, ahead = np.full(a.size, np.inf), np.full(a.size, np.inf)
        for t in np.flatnonzero((last > first) & _covering(triangles[:, :, [i, j]], a, b)):
            here = slice(first[t], last[t])
            offset, inside = _heights(triangles[t][:, [i, j, k]], a[here], b[here])
            gap = np.where(inside, offset - height[here], np.inf)
            ahead[here] = np.minimum(ahead[here], np.where(gap >= 0, gap, np.inf))
            behind[here] = np.minimum(behind[here], np.where(gap < 0, -gap, np.inf))
        backward[k, order], forward[k, order] = behind, ahead
    return backward, forward


def _covering(triangles: FloatArray, a: FloatArray, b: FloatArray) -> BoolArray:
    """Mask of the triangles ``(m, 3, 2)`` whose bounds hold a place."""
    lower = np.array([a.min(), b.min()])
    step = np.maximum(np.array([a.max(), b.max()]) - lower, 1e-300) / _BOXES
    place = np.clip(((np.stack([a, b], axis=1) - lower) / step).astype(int), 0, _BOXES - 1)
    count = np.zeros((_BOXES + 1, _BOXES + 1), dtype=np.int64)
    np.add.at(count, (place[:, 0] + 1, place[:, 1] + 1), 1)
    count = count.cumsum(axis=0).cumsum(axis=1)
    reach = (triangles - lower) / step
    # A box more on either side, so that rounding leaves no triangle out.
    low = np.clip(np.floor(reach.min(axis=1)) - 1, 0, _BOXES).astype(int).T
    high = np.clip(np.floor(reach.max(axis=1)) + 2, 0, _BOXES).astype(int).T
    inside_count = count[high[0], high[1]] - count[low[0], high[1]]
    return np.asarray(inside_count - count[high[0], low[1]] + count[low[0], low[1]] > 0)


def _heights(triangle: FloatArray, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Height of a triangle ``(3, 3)`` above points of a plane, and which points it covers."""
    (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = triangle
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    size = np.ptp(triangle, axis=0).max()
    if abs(area) <= _EDGE * size * size:
        # Parallel to the direction: its neighbours are hit instead.
        return np.zeros_like(a), np.zeros(a.size, dtype=np.bool_)
    w1 = ((a - x0) * (y2 - y0) - (x2 - x0) * (b - y0)) / area
    w2 = ((x1 - x0) * (b - y0) - (a - x0) * (y1 - y0)) / area
    inside = (w1 >= -_EDGE) & (w2 >= -_EDGE) & (w1 + w2 <= 1 + _EDGE)
    return z0 + w1 * (z1 - z0) + w2 * (z2 - z0), inside
