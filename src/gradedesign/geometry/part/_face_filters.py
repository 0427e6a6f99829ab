"""Smooth faces that one key of a region fits, and the deviations of the others.

Above 300 lines: a function for each key of one table of the case file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.geometry.part._edges import split_by
from gradedesign.geometry.part.place_words import place, plane_of
from gradedesign.geometry.part.regions_schema import (
    AXES,
    BoxSpec,
    ConeSpec,
    CylinderSpec,
    PlaneSpec,
    RegionSpec,
    SlotSpec,
)
from gradedesign.geometry.part.slots import find_slots
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Distances below this share of the diagonal do not count for planes. Chosen, not measured.
PLANE_SHARE = 1e-4
#: Nor below this one for boxes. Chosen, not measured.
BOX_SHARE = 1e-5
#: A plane's normal and a cylinder's axis may be off by so much, degrees. Chosen, not measured.
PLANE_ANGLE, AXIS_ANGLE = 1.0, 3.0
#: Relative tolerance of a diameter; facets lie inside the true circle. Between corners 16 facets
#: lie 1.9 % of the radius inside it.
DIAMETER_SHARE = 0.02
#: A half angle stated alone may be off by so much, and how far a wall goes around, degrees: facets
#: of 12 around lie between.
HALF_ANGLE, SPAN_ANGLE = 1.0, 30.0
#: The same at the ends of a range, which says itself how much may differ.
RANGE_SHARE = 0.001


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FacedPart:
    """A surface with its faces, and what the filters need of them."""

    surface: SurfaceMesh
    faces: SmoothFaces
    corners: tuple[FloatArray, ...]  #: Each ``(k, 3, 3)``, mm. Triangles of every face.
    lower: FloatArray  #: ``(3,)``, mm. Bounding box.
    upper: FloatArray  #: ``(3,)``, mm. Bounding box.
    diagonal: float  #: mm.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Match:
    """Match of every face with one key of a region."""

    key: str  #: In words, for messages.
    fits: BoolArray  #: ``(f,)``.
    #: ``(f,)``. How far a face is from fitting: 0 where it fits, about 1 where it is hopeless.
    miss: FloatArray


def faced_part(surface: SurfaceMesh, faces: SmoothFaces) -> FacedPart:
    """Gather the surface, its faces and the data that the filters need."""
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    return FacedPart(
        surface=surface,
        faces=faces,
        corners=tuple(split_by(faces.label, corner_points(surface), len(faces.faces))),
        lower=lower,
        upper=upper,
        diagonal=float(np.linalg.norm(upper - lower)),
    )


def matches(part: FacedPart, spec: RegionSpec) -> Iterator[Match]:
    """Judge every face by each geometric key, ``nearest`` and other regions excepted."""
    if spec.plane is not None:
        yield _on_plane(part, spec.plane)
    if spec.cylinder is not None:
        yield _on_cylinder(part, spec.cylinder)
    if spec.cone is not None:
        yield _on_cone(part, spec.cone)
    if spec.slot is not None:
        yield _of_slot(part, spec.slot)
    if spec.facing_vector is not None:
        yield _facing(part, np.array(spec.facing_vector), spec.angle, f"facing {spec.facing}")
    if spec.box is not None:
        yield _in_box(part, spec.box, clip=spec.clip)
    if spec.inside is not None:
        yield _centred_in_box(part, spec.inside)


def _on_plane(part: FacedPart, spec: PlaneSpec) -> Match:
    """Flat faces that lie on a plane, facing either way."""
    point, normal, words = plane_of(spec, part.lower, part.upper)
    fits, miss = [], []
    for face, corners in zip(part.faces.faces, part.corners, strict=True):
        off = float(np.abs((corners - point) @ normal).max())
        angle = 90.0 if face.normal is None else _line_angle(face.normal, normal)
        flat = face.kind == "plane"
        fits.append(flat and off <= PLANE_SHARE * part.diagonal and angle <= PLANE_ANGLE)
        miss.append(off / part.diagonal + angle / 90.0 + (not flat))
    return Match(key=words, fits=np.array(fits), miss=np.array(miss))


def _on_cylinder(part: FacedPart, spec: CylinderSpec) -> Match:
    """Cylindrical faces of a diameter, an axis, a place, a span."""
    sizes = [
        _Size("of diameter", "mm", spec.diameter, DIAMETER_SHARE, _diameter),
        _Size("that goes around by", "deg", spec.span, SPAN_ANGLE, _span, absolute=True),
    ]
    return _on_round(part, "cylinder", spec.axis, spec.point, sizes)


def _on_cone(part: FacedPart, spec: ConeSpec) -> Match:
    """Conical faces of a half angle, a wide diameter, an axis, a place."""
    sizes = [
        _Size("of half angle", "deg", spec.half_angle, HALF_ANGLE, _half_angle, absolute=True),
        _Size("of diameter", "mm", spec.diameter, DIAMETER_SHARE, _diameter),
    ]
    return _on_round(part, "cone", spec.axis, spec.point, sizes)


@dataclass(frozen=True, slots=True)
class _Size:
    """A size that faces must have: one value within a tolerance, or a range."""

    words: str
    unit: str
    stated: tuple[float, float] | None
    tolerance: float
    of: Callable[[SmoothFace], float | None]
    absolute: bool = False

    def described(self) -> str:
        low, high = self.stated or (0.0, 0.0)
        span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        return f"{self.words} {span} {self.unit}"

    def wrong(self, value: float) -> tuple[float, bool]:
        """Relative deviation of a value from the stated one, and whether it is within tolerance."""
        if self.stated is None:
            return 0.0, True
        low, high = self.stated
        off = max(low - value, value - high, 0.0)
        share = off / (low if value < low else high)
        if low != high:
            return share, share <= RANGE_SHARE
        return share, (off if self.absolute else share) <= self.tolerance


def _diameter(face: SmoothFace) -> float | None:
    return face.wide_diameter if face.kind == "cone" else face.diameter


def _span(face: SmoothFace) -> float | None:
    return face.span


def _half_angle(face: SmoothFace) -> float | None:
    return face.half_angle


def _on_round(
    part: FacedPart,
    kind: str,
    axis: str | None,
    point: tuple[float, float, float] | None,
    sizes: list[_Size],
) -> Match:
    """Faces of a round kind, of some sizes, an axis, a place."""
    words = [kind, *(size.described() for size in sizes if size.stated is not None)]
    words += [] if axis is None else [f"along {axis}"]
    words += [] if point is None else [f"about an axis through {place(np.array(point))}"]
    fits, miss = [], []
    for face in part.faces.faces:
        if face.kind != kind or face.axis is None or face.point is None:
            fits.append(False)
            miss.append(3.0)
            continue
        judged = [size.wrong(size.of(face) or 0.0) for size in sizes]
        angle = off = 0.0
        if axis is not None:
            angle = _line_angle(face.axis, np.eye(3)[AXES.index(axis)])
        if point is not None:
            off = float(np.linalg.norm(np.cross(np.array(point) - face.point, face.axis)))
        slack = DIAMETER_SHARE * (_diameter(face) or 0.0) + PLANE_SHARE * part.diagonal
        fits.append(all(right for _, right in judged) and angle <= AXIS_ANGLE and off <= slack)
        wrong = sum(min(share, 1.0) for share, _ in judged)
        miss.append(wrong + angle / 90.0 + off / part.diagonal)
    return Match(key=" ".join(words), fits=np.array(fits), miss=np.array(miss))


def _of_slot(part: FacedPart, spec: SlotSpec) -> Match:
    """Faces of slots of a width, a length, an axis."""
    sizes = [
        _Size("of width", "mm", spec.width, DIAMETER_SHARE, _diameter),
        _Size("of length", "mm", spec.length, DIAMETER_SHARE, _diameter),
    ]
    words = ["slot", *(size.described() for size in sizes if size.stated is not None)]
    words += [] if spec.axis is None else [f"along {spec.axis}"]
    fits = np.zeros(len(part.corners), dtype=bool)
    miss = np.full(len(part.corners), 3.0)
    for slot in find_slots(part.surface, part.faces):
        judged = [size.wrong(v) for size, v in zip(sizes, (slot.width, slot.length), strict=True)]
        angle = 0.0
        if spec.axis is not None:
            angle = _line_angle(slot.axis, np.eye(3)[AXES.index(spec.axis)])
        own = list(slot.faces)
        fits[own] = all(right for _, right in judged) and angle <= AXIS_ANGLE
        miss[own] = sum(min(share, 1.0) for share, _ in judged) + angle / 90.0
    return Match(key=" ".join(words), fits=fits, miss=miss)


def _facing(part: FacedPart, vector: FloatArray, limit: float, words: str) -> Match:
    """Faces whose mean outward normal points along a vector."""
    angle = np.array(
        [
            180.0
            if face.normal is None
            else np.degrees(np.arccos(np.clip(face.normal @ vector, -1.0, 1.0)))
            for face in part.faces.faces
        ]
    )
    return Match(key=f"{words} within {limit:g} deg", fits=angle <= limit, miss=angle / 90.0)


def _in_box(part: FacedPart, spec: BoxSpec, *, clip: bool) -> Match:
    """Faces with every corner in a box; with ``clip`` those that reach into its bounds."""
    lower, upper = np.array(spec.lower), np.array(spec.upper)
    tolerance = BOX_SHARE * part.diagonal
    outside = []
    for corners in part.corners:
        points = corners.reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        if clip:  # how far the face's own bounds stay away from the box
            low, high = high, low
        outside.append(float(np.maximum(lower - low, high - upper).max()))
    off = np.array(outside)
    return Match(
        key=f"box {place(lower)} to {place(upper)}",
        fits=off <= tolerance,
        miss=np.maximum(off, 0.0) / part.diagonal,
    )


def _centred_in_box(part: FacedPart, spec: BoxSpec) -> Match:
    """Faces whose centroid lies in a box."""
    lower, upper = np.array(spec.lower), np.array(spec.upper)
    centroid = np.array([face.centroid for face in part.faces.faces])
    off = np.maximum(lower - centroid, centroid - upper).max(axis=1)
    return Match(
        key=f"centroid inside {place(lower)} to {place(upper)}",
        fits=off <= BOX_SHARE * part.diagonal,
        miss=np.maximum(off, 0.0) / part.diagonal,
    )


def _line_angle(a: FloatArray, b: FloatArray) -> float:
    """Degrees between two lines along unit vectors."""
    return float(np.degrees(np.arcsin(np.clip(np.linalg.norm(np.cross(a, b)), 0.0, 1.0))))
