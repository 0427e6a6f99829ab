"""Selectors of single smooth faces: the keys of a region of the case file that find one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.common.values.toml_text import toml_value
from gradedesign.geometry.part._face_filters import FacedPart, faced_part, matches
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.regions import nearest_face
from gradedesign.geometry.part.regions_schema import AXES, RegionSpec
from gradedesign.geometry.part.round_shapes import RoundShapes, shape_of_face
from gradedesign.geometry.part.slots import find_slots
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces
from gradedesign.geometry.triangles._surface_mesh_kernels import triangle_areas
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Faces that get selectors, the largest first: each costs a look at every face. Chosen, not
#: measured.
MOST_FACES = 300
#: Half the edge of the box around the centroid of a face that nothing else describes, over the
#: part's diagonal. Chosen, not measured.
_AROUND = 1e-3
#: Share of the part's size below which a coordinate is rounding noise.
_NOISE = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceSelector:
    """Keys of a region and the smooth faces that they find."""

    faces: tuple[int, ...]  #: Numbers of the smooth faces, rising.
    #: As a region of the case file states them, with the ``count`` of these faces.
    keys: Mapping[str, Any]

    @property
    def text(self) -> str:
        """The keys in TOML, one a line."""
        return "\n".join(f"{key} = {toml_value(value)}" for key, value in self.keys.items())


def face_selectors(
    surface: SurfaceMesh, faces: SmoothFaces, file_faces: FileFaces | None = None
) -> dict[int, tuple[FaceSelector, ...]]:
    """Selectors of the largest faces of a part.

    ``faces``: of that surface. ``file_faces``: faces of the file on that surface.

    Returns
    -------
    dict of int to tuple of FaceSelector
        By the number of the smooth face: first what finds it alone, then what finds it with others
        like it. Each was tried on the part, as a region of a case is.
    """
    part = faced_part(surface, faces)
    slots = {number: slot for slot in find_slots(surface, faces) for number in slot.faces}
    areas = triangle_areas(surface.vertices, surface.faces)
    of_file = {} if file_faces is None else _whole_faces(faces, file_faces)
    largest = np.argsort([-face.area for face in faces.faces], kind="stable")[:MOST_FACES]
    found: dict[int, tuple[FaceSelector, ...]] = {}
    for number in largest.tolist():
        face = faces.faces[number]
        own = np.flatnonzero(faces.label == number)
        on_face = surface.vertices[surface.faces[own[np.argmax(areas[own])]]].mean(axis=0)
        shape = shape_of_face(face)
        candidates: list[dict[str, Any]] = []
        if number in slots:
            slot = slots[number]
            size = {"width": f"{slot.width:.4g} mm", "length": f"{slot.length:.4g} mm"}
            candidates.append({"slot": size})
        elif shape is not None:
            candidates += _round(shape, part.diagonal)
        candidates += _flat(face, part)
        # Numbers of a file may change as it is written again: what is measured comes first.
        candidates += [{"face": of_file[number]}] if number in of_file else []
        selectors = [s for keys in candidates if (s := _tried(part, keys, number, of_file))]
        if not any(len(selector.faces) == 1 for selector in selectors):
            selectors += _single(part, selectors, number, on_face)
        selectors.sort(key=lambda selector: len(selector.faces))
        alone = [s for s in selectors if len(s.faces) == 1][:1]
        found[number] = (*alone, *[s for s in selectors if len(s.faces) > 1][:1])
    return found


def _whole_faces(faces: SmoothFaces, file_faces: FileFaces) -> dict[int, int]:
    """Smooth faces that are one face of the file, with its number there."""
    pairs = np.unique(np.stack([faces.label, file_faces.label]), axis=1)
    once = [np.bincount(row + 1, minlength=int(row.max()) + 2) == 1 for row in pairs]
    return {
        int(smooth): int(number)
        for smooth, number in pairs.T
        if number >= 0 and once[0][smooth + 1] and once[1][number + 1]
    }


def _flat(face: SmoothFace, part: FacedPart) -> Iterator[dict[str, Any]]:
    """Planes that hold a flat face."""
    if face.kind != "plane" or face.normal is None:
        return
    axis = int(np.argmax(np.abs(face.normal)))
    at = float(face.centroid[axis])
    for side in ("min", "max"):
        yield {"plane": f"{AXES[axis]} = {side}"}
    yield {"plane": f"{AXES[axis]} = {_length(at, part.diagonal)}"}
    normal = [round(float(value), 6) + 0.0 for value in face.normal]
    yield {"plane": {"point": _point(face.centroid, part.diagonal), "normal": normal}}


def _round(shape: RoundShapes, size: float) -> Iterator[dict[str, Any]]:
    """Cylinders or cones like a face, then the one about its axis."""
    key, stated = shape.keys
    yield {key: stated}
    yield {key: {**stated, "point": _point(shape.points[0], size)}}


def _single(
    part: FacedPart, selectors: list[FaceSelector], number: int, on_face: FloatArray
) -> list[FaceSelector]:
    """Selectors of one face among those that others find, by a point on it or by its centroid."""
    candidates = [
        {**{key: value for key, value in selector.keys.items() if key != "count"},
         "nearest": _point(on_face, part.diagonal)}
        for selector in selectors
    ]  # fmt: skip
    centroid = part.faces.faces[number].centroid
    corner = [centroid + sign * _AROUND * part.diagonal for sign in (-1.0, 1.0)]
    lower, upper = (_point(point, part.diagonal) for point in corner)
    candidates.append({"inside": {"lower": lower, "upper": upper}})
    tried = (_tried(part, keys, number, {}) for keys in candidates)
    return [s for s in tried if s is not None and len(s.faces) == 1][:1]


def _tried(
    part: FacedPart, keys: Mapping[str, Any], number: int, of_file: Mapping[int, int]
) -> FaceSelector | None:
    """The selector of some keys; None where they do not find the face."""
    if "face" in keys:
        found = [number] if of_file.get(number) == keys["face"] else []
    else:
        found = np.flatnonzero(_fits(part, keys)).tolist()
    if number not in found:
        return None
    return FaceSelector(faces=tuple(found), keys={**keys, "count": len(found)})


def _fits(part: FacedPart, keys: Mapping[str, Any]) -> BoolArray:
    """Faces that the keys of a region find, ``(f,)``."""
    try:
        spec = RegionSpec.model_validate(dict(keys))
    except ValidationError:
        return np.zeros(len(part.corners), dtype=bool)
    fits = np.asarray(np.all([match.fits for match in matches(part, spec)], axis=0))
    if spec.nearest is not None and fits.any():
        return nearest_face(part, fits, np.array(spec.nearest))
    return fits


def _point(point: FloatArray, size: float) -> list[str]:
    return [_length(float(value), size) for value in point]


def _length(value: float, size: float) -> str:
    return f"{0.0 if abs(value) < _NOISE * size else value:.6g} mm"
