"""The bore whose wall a region is: its axis, to which bearing pressures are radial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.geometry.part._face_filters import AXIS_ANGLE, DIAMETER_SHARE
from gradedesign.geometry.part.smooth_faces import SmoothFace


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bore:
    """A cylindrical hole."""

    axis: FloatArray  #: ``(3,)``. Unit vector.
    point: FloatArray  #: ``(3,)``, mm. On the axis.

    def __post_init__(self) -> None:
        lock(self, axis=(3,), point=(3,))

    def radial(self, points: FloatArray) -> FloatArray:
        """Unit vectors away from the axis at points ``(3, ...)``, which lie off it."""
        shape = (3, *[1] * (points.ndim - 1))
        arm = points - self.point.reshape(shape)
        along = np.tensordot(self.axis, arm, axes=1)
        across = arm - self.axis.reshape(shape) * along
        return np.asarray(across / np.linalg.norm(across, axis=0))

    def across(self, vector: FloatArray) -> FloatArray:
        """The part of a vector ``(3,)`` that is square to the axis."""
        return np.asarray(vector - (vector @ self.axis) * self.axis)


def common_bore(faces: Sequence[SmoothFace]) -> Bore | None:
    """The bore that faces are the wall of, in pieces or in lugs one behind another, if they are.

    Of the largest face; axes and diameters may differ as selectors of regions allow.
    """
    wall = max(faces, key=lambda face: face.area)
    if wall.axis is None or wall.point is None or wall.diameter is None:
        return None
    slack = DIAMETER_SHARE * wall.diameter
    for face in faces:
        if face.axis is None or face.point is None or face.diameter is None or not face.concave:
            return None
        offset = float(np.linalg.norm(np.cross(face.point - wall.point, wall.axis)))
        tilted = abs(float(face.axis @ wall.axis)) < np.cos(np.radians(AXIS_ANGLE))
        if tilted or offset > slack or abs(face.diameter - wall.diameter) > slack:
            return None
    return Bore(axis=wall.axis, point=wall.point)
