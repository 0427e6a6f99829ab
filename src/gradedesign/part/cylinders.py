"""The cylindrical faces of a part, gathered by diameter and axis: its holes, bosses, roundings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.case.regions_schema import AXES
from gradedesign.part._face_filters import AXIS_ANGLE
from gradedesign.part.smooth_faces import SmoothFace, SmoothFaces

#: Diameters that differ by less than this share are one diameter.
_SAME_DIAMETER = 0.005


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylinderGroup:
    """Cylindrical faces of one diameter along one direction.

    Attributes
    ----------
    diameter : float, mm
    axis : (3,) array
        Unit vector; its largest component is positive.
    concave : bool
        True for holes, False for bosses and rounded edges.
    points : (n, 3) array, mm
        On the axis of each face, halfway along it.
    area : float, mm^2
        Of all faces.
    """

    diameter: float
    axis: FloatArray
    concave: bool
    points: FloatArray
    area: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", locked(self.axis, (3,), name="axis"))
        object.__setattr__(self, "points", locked(self.points, (None, 3), name="points"))

    @property
    def count(self) -> int:
        """Faces, as the key ``count`` of a region counts them."""
        return len(self.points)

    @property
    def axis_name(self) -> str | None:
        """``x``, ``y`` or ``z`` where a region's key ``axis`` finds it, else None."""
        nearest = int(np.argmax(np.abs(self.axis)))
        upright = abs(float(self.axis[nearest])) >= np.cos(np.radians(AXIS_ANGLE))
        return AXES[nearest] if upright else None

    @property
    def selector(self) -> str:
        """Selector by which a region of the case file selects these faces."""
        axis = "" if self.axis_name is None else f', axis = "{self.axis_name}"'
        return f'cylinder = {{diameter = "{self.diameter:.4g} mm"{axis}}}'


def cylinder_groups(faces: SmoothFaces) -> tuple[CylinderGroup, ...]:
    """Gather the cylindrical faces of a part.

    Parameters
    ----------
    faces : SmoothFaces

    Returns
    -------
    tuple of CylinderGroup
        Holes first, each kind from the smallest diameter on.
    """
    groups: list[list[SmoothFace]] = []
    for face in faces.faces:
        if face.diameter is None:
            continue
        home = next((group for group in groups if _alike(group[0], face)), None)
        if home is None:
            groups.append([face])
        else:
            home.append(face)
    gathered = [_group(group) for group in groups]
    return tuple(sorted(gathered, key=lambda g: (not g.concave, g.diameter, *g.axis)))


def _alike(first: SmoothFace, second: SmoothFace) -> bool:
    """Whether two cylindrical faces have one diameter, direction and sense."""
    if (
        first.axis is None
        or second.axis is None
        or first.diameter is None
        or second.diameter is None
    ):
        return False
    off = float(np.linalg.norm(np.cross(first.axis, second.axis)))
    return (
        first.concave == second.concave
        and abs(first.diameter / second.diameter - 1.0) <= _SAME_DIAMETER
        and off <= np.sin(np.radians(AXIS_ANGLE))
    )


def _group(faces: list[SmoothFace]) -> CylinderGroup:
    """One group of faces that are alike."""
    return CylinderGroup(
        diameter=float(np.mean([face.diameter or 0.0 for face in faces])),
        axis=np.zeros(3) if faces[0].axis is None else faces[0].axis,
        concave=bool(faces[0].concave),
        points=np.array([face.centroid if face.point is None else face.point for face in faces]),
        area=float(sum(face.area for face in faces)),
    )
