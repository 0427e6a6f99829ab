"""Points, directions and planes as a person reads them."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.part.regions_schema import AXES, PlaneSpec

#: Of a coordinate from here on, mm, four figures are coarser than a hundredth of a millimetre.
_LARGE = 100.0


def place(point: FloatArray) -> str:
    """Write a point in mm."""
    return f"({', '.join(number(v) for v in point)}) mm"


def number(value: float) -> str:
    """Write a coordinate in mm: to four figures, to 0.01 mm where it is large."""
    value = round(float(value), 9) + 0.0  # without the rounding around zero
    return f"{value:.4g}" if abs(value) < _LARGE else f"{round(value, 2):.12g}"


def direction(vector: tuple[float, float, float] | FloatArray) -> str:
    """Write a unit vector."""
    x, y, z = (round(float(v), 3) + 0.0 for v in vector)
    return f"({x:g}, {y:g}, {z:g})"


def plane_of(
    spec: PlaneSpec, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, str]:
    """Point, mm, unit normal and name of a stated plane, in a part between two corners ``(3,)``."""
    if spec.point is not None and spec.normal is not None:
        words = f"plane through {place(np.array(spec.point))} normal to {direction(spec.normal)}"
        return np.array(spec.point), np.array(spec.normal), words
    axis = spec.axis or 0
    value = {"min": lower[axis], "max": upper[axis]}.get(str(spec.position), spec.position)
    point, normal = np.zeros(3), np.zeros(3)
    point[axis], normal[axis] = value, 1.0
    stated = spec.position if isinstance(spec.position, str) else f"{spec.position:g} mm"
    return point, normal, f'plane "{AXES[axis]} = {stated}"'
