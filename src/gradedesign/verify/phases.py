"""The exclusion zone around clamped regions."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray


def evaluated_at(points: FloatArray, clamped: tuple[Field, ...], radius: float) -> BoolArray:
    """Points farther than the exclusion radius from every clamped region, ``(n,)``."""
    keep = np.ones(points.shape[1:], dtype=bool)
    for distance in clamped:
        keep &= distance(points) > radius
    return keep
