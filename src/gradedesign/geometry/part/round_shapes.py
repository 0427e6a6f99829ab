"""The round shapes of a part, gathered by kind, size and axis: holes, slots, cones, bosses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.common.values.toml_text import toml_value
from gradedesign.geometry.part._face_filters import AXIS_ANGLE, HALF_ANGLE
from gradedesign.geometry.part.regions_schema import AXES
from gradedesign.geometry.part.slots import HALF, Slot, find_slots, is_half
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Diameters, widths and lengths that differ by less than this share are one. Chosen, not measured.
_SAME_SIZE = 0.005
#: Kinds in the order in which they are listed.
KINDS = (
    *("hole", "half bore", "inner rounding", "slot"),
    *("countersink or inner cone", "outer cone", "boss or rounding"),
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoundShapes:
    """Round shapes of one kind and size along one direction."""

    kind: str  #: One of `KINDS`.
    diameter: float  #: mm. Of a cylinder; of a cone where it is widest; the width of a slot.
    axis: FloatArray  #: ``(3,)``. Unit vector; its largest component is positive.
    points: FloatArray  #: ``(n, 3)``, mm. On the axis of each one, halfway along it.
    count: int  #: Faces, as the key ``count`` of a region counts them.
    area: float  #: mm^2. Of all faces.
    half_angle: float | None = None  #: degrees. Of a cone.
    length: float | None = None  #: mm. Of a slot, over its ends.

    def __post_init__(self) -> None:
        lock(self, axis=(3,), points=(None, 3))

    @property
    def axis_name(self) -> str | None:
        """``x``, ``y`` or ``z`` where a region's key ``axis`` finds it, else None."""
        nearest = int(np.argmax(np.abs(self.axis)))
        upright = abs(float(self.axis[nearest])) >= np.cos(np.radians(AXIS_ANGLE))
        return AXES[nearest] if upright else None

    @property
    def keys(self) -> tuple[str, dict[str, Any]]:
        """Key of a region of the case file that selects these faces, and what it states."""
        stated: dict[str, Any] = {}
        if self.length is not None:
            key = "slot"
            stated["width"] = f"{self.diameter:.4g} mm"
            stated["length"] = f"{self.length:.4g} mm"
        elif self.half_angle is not None:
            key = "cone"
            stated["half_angle"] = f"{self.half_angle:.4g} deg"
            stated["diameter"] = f"{self.diameter:.4g} mm"
        else:
            key = "cylinder"
            stated["diameter"] = f"{self.diameter:.4g} mm"
            if self.kind == "half bore":
                stated["span"] = "180 deg"
        if self.axis_name is not None:
            stated["axis"] = self.axis_name
        return key, stated

    @property
    def selector(self) -> str:
        """Selector by which a region of the case file selects these faces."""
        key, stated = self.keys
        return f"{key} = {toml_value(stated)}"


def round_shapes(surface: SurfaceMesh, faces: SmoothFaces) -> tuple[RoundShapes, ...]:
    """Gather the cylinders, cones and slots of a part; a slot's ends count as its own only.

    Returns tuple of RoundShapes: in the order of `KINDS`, each kind from the smallest diameter on.

    ``faces``: of that surface.
    """
    slots = find_slots(surface, faces)
    ends = {number for slot in slots for number in slot.faces}
    single = [_of_slot(slot) for slot in slots]
    single += [
        shape
        for number, face in enumerate(faces.faces)
        if number not in ends and (shape := shape_of_face(face)) is not None
    ]
    groups: list[list[RoundShapes]] = []
    for shape in single:
        home = next((group for group in groups if _alike(group[0], shape)), None)
        if home is None:
            groups.append([shape])
        else:
            home.append(shape)
    gathered = [_group(group) for group in groups]
    return tuple(sorted(gathered, key=lambda g: (KINDS.index(g.kind), g.diameter, *g.axis)))


def _of_slot(slot: Slot) -> RoundShapes:
    return RoundShapes(
        kind="slot",
        diameter=slot.width,
        axis=slot.axis,
        points=slot.point[None],
        count=len(slot.faces),
        area=slot.area,
        length=slot.length,
    )


def shape_of_face(face: SmoothFace) -> RoundShapes | None:
    """A cylindrical or conical face as a group of its own."""
    if face.axis is None or face.point is None or face.span is None:
        return None
    if face.kind == "cone":
        kind = "countersink or inner cone" if face.concave else "outer cone"
        diameter = face.wide_diameter
    else:
        kind, diameter = "boss or rounding", face.diameter
        if face.concave:
            kind = "hole" if face.span > HALF[1] else "inner rounding"
            kind = "half bore" if is_half(face) else kind
    return RoundShapes(
        kind=kind,
        diameter=diameter or 0.0,
        axis=face.axis,
        points=face.point[None],
        count=1,
        area=face.area,
        half_angle=face.half_angle,
    )


def _alike(first: RoundShapes, second: RoundShapes) -> bool:
    """Whether two shapes have one kind, size and direction."""
    off = float(np.linalg.norm(np.cross(first.axis, second.axis)))
    angles = abs((first.half_angle or 0.0) - (second.half_angle or 0.0))
    lengths = (first.length or 1.0) / (second.length or 1.0)
    return (
        first.kind == second.kind
        and abs(first.diameter / second.diameter - 1.0) <= _SAME_SIZE
        and abs(lengths - 1.0) <= _SAME_SIZE
        and angles <= HALF_ANGLE
        and off <= np.sin(np.radians(AXIS_ANGLE))
    )


def _group(shapes: list[RoundShapes]) -> RoundShapes:
    """Gather equal shapes into one group."""
    first = shapes[0]
    return RoundShapes(
        kind=first.kind,
        diameter=float(np.mean([shape.diameter for shape in shapes])),
        axis=first.axis,
        points=np.concatenate([shape.points for shape in shapes]),
        count=sum(shape.count for shape in shapes),
        area=float(sum(shape.area for shape in shapes)),
        half_angle=first.half_angle,
        length=first.length,
    )
