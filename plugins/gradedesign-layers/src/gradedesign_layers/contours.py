"""Closed contours of a layer: marching squares with the solid on the left."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray, IntArray
from gradedesign_layers._contour_kernels import polygon_areas, trace


class Tracer:
    """Contours of layers of one size, one after the other; it keeps the memory between them."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self._stamp = np.zeros(shape, dtype=np.int32)
        self._number = 0
        self._reserve(4 * sum(shape))

    def _reserve(self, points: int) -> None:
        self._places, self._scratch = np.zeros((2, points, 2))
        self._first = np.zeros(points, dtype=np.int64)

    def polygons(self, values: FloatArray) -> tuple[FloatArray, IntArray]:
        """Points ``(k, 2)`` of all contours in steps of the grid, and where each begins.

        Parameters
        ----------
        values : (nx, ny) array
            Positive along the border; no value is 0.

        Returns
        -------
        places : (k, 2) array
            Of the contours in turn: counter-clockwise around solid, clockwise around holes; the
            last point is not the first again.
        first : (n + 1,) int array
        """
        while True:
            self._number += 1
            count = trace(
                *(values, self._stamp, self._number, self._places, self._first, self._scratch)
            )
            if count >= 0:
                first = self._first[: count + 1].copy()
                return self._places[: first[-1]].copy(), first
            self._reserve(2 * len(self._places))


def enclosed_areas(places: FloatArray, first: IntArray) -> FloatArray:
    """Areas enclosed by polygons, ``(n,)``, negative if clockwise; see `Tracer.polygons`."""
    areas = np.zeros(len(first) - 1)
    polygon_areas(places, first, areas)
    return areas


def signed_area(polygon: FloatArray) -> float:
    """Area enclosed by a polygon ``(n, 2)``, negative if clockwise."""
    x, y = (polygon - polygon[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
