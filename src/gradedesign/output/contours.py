"""Closed contours of a layer: marching squares with the solid on the left."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray

#: Directed segments of a square by its solid corners (bits: lower left, lower right, upper right,
#: upper left), from side to side; sides: 0 below, 1 right, 2 above, 3 left. Solid corners that
#: touch across a square are apart, as pixels are that share a corner only.
_SEGMENTS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((0, 3),), 2: ((1, 0),), 4: ((2, 1),), 8: ((3, 2),),
    3: ((1, 3),), 6: ((2, 0),), 12: ((3, 1),), 9: ((0, 2),),
    14: ((3, 0),), 13: ((0, 1),), 11: ((1, 2),), 7: ((2, 3),),
    5: ((0, 3), (2, 1)), 10: ((1, 0), (3, 2)),
}  # fmt: skip
#: A point within this distance of the line between its neighbours is left out, steps.
_STRAIGHT = 1e-4


def contours(values: FloatArray) -> list[FloatArray]:
    """Closed polygons around what is negative, in steps of the grid.

    Parameters
    ----------
    values : (nx, ny) array
        Positive along the border; no value is 0.

    Returns
    -------
    list of (n, 2) array
        Counter-clockwise around solid, clockwise around holes; the last point is not the first
        again.
    """
    nx, ny = values.shape
    solid = values < 0.0
    case = (solid[:-1, :-1] + 2 * solid[1:, :-1] + 4 * solid[1:, 1:] + 8 * solid[:-1, 1:]).astype(
        np.int64
    )
    starts, ends = [], []
    for code, segments in _SEGMENTS.items():
        i, j = np.nonzero(case == code)
        for begun, ended in segments:
            starts.append(_edge(begun, i, j, nx, ny))
            ends.append(_edge(ended, i, j, nx, ny))
    start, end = np.concatenate(starts), np.concatenate(ends)
    order = np.argsort(start)
    start, end = start[order], end[order]
    # Every edge that the contour crosses begins one segment and ends another.
    following = np.searchsorted(start, end)
    points = _crossings(values, start)
    return [_without_straight(points[cycle]) for cycle in _cycles(following)]


def signed_area(polygon: FloatArray) -> float:
    """Area enclosed by a polygon ``(n, 2)``, negative if clockwise."""
    x, y = (polygon - polygon[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _edge(side: int, i: IntArray, j: IntArray, nx: int, ny: int) -> IntArray:
    """Number of the grid edge on a side of squares: those along x first, then those along y."""
    along_y = side in (1, 3)
    return along_y * nx * ny + (i + (side == 1)) * ny + j + (side == 2)


def _crossings(values: FloatArray, edge: IntArray) -> FloatArray:
    """Zeros of the linear value on each edge, ``(n, 2)``."""
    nx, ny = values.shape
    along_y, at = np.divmod(edge, nx * ny)
    i, j = np.divmod(at, ny)
    here, there = values[i, j], values[i + 1 - along_y, j + along_y]
    share = here / (here - there)
    return np.stack([i + np.where(along_y, 0.0, share), j + np.where(along_y, share, 0.0)], axis=1)


def _cycles(following: IntArray) -> list[list[int]]:
    left = following.tolist()
    seen = [False] * len(left)
    cycles = []
    for first in range(len(left)):
        cycle = []
        now = first
        while not seen[now]:
            seen[now] = True
            cycle.append(now)
            now = left[now]
        if cycle:
            cycles.append(cycle)
    return cycles


def _without_straight(polygon: FloatArray) -> FloatArray:
    """Drop points on the line between their neighbours."""
    before, after = np.roll(polygon, 1, axis=0), np.roll(polygon, -1, axis=0)
    chord = after - before
    length = np.hypot(*chord.T)
    off = np.abs(chord[:, 0] * (polygon - before)[:, 1] - chord[:, 1] * (polygon - before)[:, 0])
    bent = off > _STRAIGHT * np.maximum(length, 1e-12)
    return polygon[bent] if np.count_nonzero(bent) >= 3 else polygon
