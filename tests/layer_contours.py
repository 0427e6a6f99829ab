"""Contours of one layer as a list of polygons."""

import numpy as np

from gradedesign.output.contours import Tracer


def contours(values):
    """Closed polygons ``(n, 2)`` around what is negative in a layer ``(nx, ny)``."""
    places, first = Tracer(values.shape).polygons(values)
    return np.split(places, first[1:-1]) if len(first) > 1 else []
