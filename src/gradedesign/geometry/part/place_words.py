"""Points as a person reads them."""

from __future__ import annotations

from gradedesign.arrays import FloatArray

#: Of a coordinate from here on, mm, four figures are coarser than a hundredth of a millimetre.
_LARGE = 100.0


def place(point: FloatArray) -> str:
    """Write a point in mm."""
    return f"({', '.join(number(v) for v in point)}) mm"


def number(value: float) -> str:
    """Write a coordinate in mm: to four figures, to 0.01 mm where it is large."""
    value = round(float(value), 9) + 0.0  # without the rounding around zero
    return f"{value:.4g}" if abs(value) < _LARGE else f"{round(value, 2):.12g}"
