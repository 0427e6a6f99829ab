"""A drain hole: a round hole from the part's surface into a void."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import LatticeError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drain:
    """A hole along a straight axis, with a round bottom.

    Attributes
    ----------
    mouth : (3,) array, mm
        On the part's surface.
    inward : (3,) array
        Unit direction of the axis.
    radius : float, mm
    depth : float, mm
        Of the axis below the mouth; the bottom reaches a radius deeper.

    Raises
    ------
    LatticeError
        If radius or depth are not positive.
    """

    mouth: FloatArray
    inward: FloatArray
    radius: float
    depth: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mouth", locked(self.mouth, (3,), name="mouth"))
        object.__setattr__(self, "inward", locked(self.inward, (3,), name="inward"))
        if not (self.radius > 0 and self.depth > 0):
            raise LatticeError(
                f"a drain hole of radius {self.radius:g} mm and depth {self.depth:g} mm is "
                f"impossible; expected both above 0 mm"
            )


def drain_value(drain: Drain, points: FloatArray) -> FloatArray:
    """Distance to the hole at points ``(3, ...)`` mm, ``(...)``, mm, negative in it.

    It goes on for a radius outside the part, so that a curved mouth is open all round.
    """
    flat = np.asarray(points, dtype=np.float64).reshape(3, -1) - drain.mouth[:, None]
    along = np.clip(drain.inward @ flat, -drain.radius, drain.depth)
    away = np.linalg.norm(flat - drain.inward[:, None] * along, axis=0)
    return np.asarray(away - drain.radius).reshape(np.shape(points)[1:])
