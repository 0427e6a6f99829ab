"""The surface that a face of a CAD file lies on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, locked

KINDS = ("plane", "cylinder", "other")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExactSurface:
    """Kind of a face's surface and, of a cylinder, where it is: as the file says, not fitted.

    Attributes
    ----------
    kind : {"plane", "cylinder", "other"}
    axis : (3,) array or None
        Of a cylinder: along its axis; a unit vector once stored.
    point : (3,) array or None, file units
        Of a cylinder: on its axis.
    diameter : float or None, file units
        Of a cylinder.
    """

    kind: str
    axis: FloatArray | ArrayLike | None = None
    point: FloatArray | ArrayLike | None = None
    diameter: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"a surface of kind {self.kind!r}; expected {', '.join(KINDS)}")
        if (self.kind == "cylinder") != (self.placed is not None):
            raise ValueError(
                f"a {self.kind} with axis {self.axis}, point {self.point} and "
                f"diameter {self.diameter}; expected them of cylinders"
            )
        if self.placed is None:
            return
        axis, point, diameter = self.placed
        length = float(np.linalg.norm(axis))
        if not (0.0 < length < np.inf and 0.0 < diameter < np.inf and np.isfinite(point).all()):
            raise ValueError(
                f"a cylinder with axis {axis} and diameter {diameter}; expected "
                f"finite values above 0"
            )
        object.__setattr__(self, "axis", locked(axis / length, (3,), name="axis"))
        object.__setattr__(self, "point", locked(point, (3,), name="point"))

    @property
    def placed(self) -> tuple[FloatArray, FloatArray, float] | None:
        """Axis, point and diameter of a cylinder."""
        if self.axis is None or self.point is None or self.diameter is None:
            return None
        return np.asarray(self.axis, float), np.asarray(self.point, float), self.diameter

    def scaled(self, factor: float) -> ExactSurface:
        """The same surface in another unit."""
        if self.placed is None:
            return self
        _, point, diameter = self.placed
        return replace(self, point=point * factor, diameter=diameter * factor)
