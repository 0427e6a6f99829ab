"""Slots with round ends: two half cylinders and the flat sides between them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Degrees around their axes that round ends may cover: facets lie between, and the first of a flat
#: side may pass for one of an end.
HALF = (150.0, 210.0)
#: Axes of the ends may be off by so much, sine of 3 degrees. Chosen, not measured.
_TURNED = np.sin(np.radians(3.0))
#: Ends of one slot have one diameter, and faces lie in its wall, within this share of its width:
#: what facets of a remeshed end may lie inside its circle.
_SAME = 0.03


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slot:
    """A slot with round ends."""

    width: float  #: mm. The diameter of its ends.
    length: float  #: mm. Over its ends.
    #: ``(3,)``. Unit vector across width and length; its largest component is positive.
    axis: FloatArray
    point: FloatArray  #: ``(3,)``, mm. Its middle.
    faces: tuple[int, ...]  #: The two ends, then the sides and what remeshing left between them.
    area: float  #: mm^2.

    def __post_init__(self) -> None:
        lock(self, axis=(3,), point=(3,))


def is_half(face: SmoothFace) -> bool:
    """Whether a face is half of the wall of a hole."""
    span = face.span
    return bool(face.kind == "cylinder" and face.concave and span and HALF[0] <= span <= HALF[1])


def find_slots(surface: SurfaceMesh, faces: SmoothFaces) -> tuple[Slot, ...]:
    """Slots of a part.

    Returns tuple of Slot: in the order of their first faces.

    ``faces``: of that surface.
    """
    ends = [number for number, face in enumerate(faces.faces) if is_half(face)]
    if len(ends) < 2:
        return ()
    corners = corner_points(surface)
    parts = [corners[faces.label == number].reshape(-1, 3) for number in range(len(faces.faces))]
    found: list[Slot] = []
    used: set[int] = set()
    for first, second in combinations(ends, 2):
        if not used & {first, second}:
            slot = _slot(faces.faces, parts, first, second)
            if slot is not None:
                found.append(slot)
                used |= {first, second}
    return tuple(found)


def _slot(
    faces: tuple[SmoothFace, ...], parts: list[FloatArray], first: int, second: int
) -> Slot | None:
    """The slot of two ends, where flat faces between them are its sides.

    Of a remeshed part narrow faces of no kind are left beside the ends: they lie in its wall too.
    """
    one, other = faces[first], faces[second]
    if (
        one.axis is None
        or other.axis is None
        or one.point is None
        or other.point is None
        or one.diameter is None
        or other.diameter is None
    ):
        return None
    width = 0.5 * (one.diameter + other.diameter)
    along = other.point - one.point
    along = along - (along @ one.axis) * one.axis
    distance = float(np.linalg.norm(along))
    if (
        np.linalg.norm(np.cross(one.axis, other.axis)) > _TURNED
        or abs(one.diameter - other.diameter) > _SAME * width
        or distance <= _SAME * width
    ):
        return None
    frame = np.stack([along / distance, np.cross(one.axis, along / distance), one.axis], axis=1)
    depth = (np.concatenate([parts[first], parts[second]]) - one.point) @ one.axis
    slack = _SAME * width
    # On which side of the middle flat faces lie, and whether they face it, as outward faces do.
    sides: set[tuple[bool, bool]] = set()
    rest = []
    for number, face in enumerate(faces):
        if face.kind not in ("plane", "other"):
            continue
        x, y, z = ((parts[number] - one.point) @ frame).T
        beyond = np.maximum(np.maximum(-x, x - distance), 0.0)
        off = np.abs(np.hypot(beyond, y) - 0.5 * width)
        deep = z.min() >= depth.min() - slack and z.max() <= depth.max() + slack
        if not deep or off.max() > slack:
            continue
        if face.kind == "plane" and face.normal is not None:
            upper = bool(y.mean() > 0.0)
            sides.add((upper, bool((face.normal @ frame[:, 1] > 0.0) != upper)))
        rest.append(number)
    if sides != {(False, True), (True, True)}:
        return None
    members = (first, second, *rest)
    return Slot(
        width=width,
        length=distance + width,
        axis=one.axis,
        point=0.5 * (one.point + other.point),
        faces=members,
        area=float(sum(faces[number].area for number in members)),
    )
