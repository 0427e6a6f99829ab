"""Smooth faces of a part in words: what each is, its measures, and what selects it in a case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.geometry.part.face_selectors import face_selectors
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.place_words import direction, place
from gradedesign.geometry.part.round_shapes import shape_of_face
from gradedesign.geometry.part.smooth_faces import SmoothFace, SmoothFaces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceWords:
    """A face of a part in words."""

    kind: str  #: Such as ``"hole, 9 mm"``.
    area: float  #: mm^2.
    facts: tuple[tuple[str, str], ...]  #: Names and values, with units.
    regions: tuple[tuple[str, str], ...]  #: What a region finds, and its table of the case file.


def described_faces(
    surface: SurfaceMesh, faces: SmoothFaces, file_faces: FileFaces | None = None
) -> tuple[FaceWords, ...]:
    """Every face of a part, in the order of ``faces``; very many have regions for the largest."""
    selectors = face_selectors(surface, faces, file_faces)
    numbers = {} if file_faces is None else _file_numbers(faces, file_faces)
    described = []
    for number, face in enumerate(faces.faces):
        regions = []
        for selector in selectors.get(number, ()):
            count = len(selector.faces)
            name = f"face_{number}" if count == 1 else f"faces_like_{number}"
            found = "this face" if count == 1 else f"{count} faces like it"
            regions.append((found, f"[region.{name}]\n{selector.text}\n"))
        facts = (*_facts(face), *numbers.get(number, ()))
        words = FaceWords(kind=_kind(face), area=face.area, facts=facts, regions=tuple(regions))
        described.append(words)
    return tuple(described)


def _file_numbers(
    faces: SmoothFaces, file_faces: FileFaces
) -> dict[int, tuple[tuple[str, str], ...]]:
    """Faces of the file under each smooth face."""
    found: dict[int, list[str]] = {}
    for smooth, number in np.unique([faces.label, file_faces.label], axis=1).T.tolist():
        if number >= 0:
            name = file_faces.names.get(number)
            found.setdefault(smooth, []).append(f"{number}" + (f" ({name})" if name else ""))
    return {smooth: (("face of the file", ", ".join(each)),) for smooth, each in found.items()}


def _kind(face: SmoothFace) -> str:
    shape = shape_of_face(face)
    if shape is not None:
        return f"{shape.kind}, {shape.diameter:.4g} mm"
    return {"plane": "flat face", "other": "curved face"}.get(face.kind, face.kind)


def _facts(face: SmoothFace) -> tuple[tuple[str, str], ...]:
    shape = shape_of_face(face)
    facts = [("area", f"{face.area:.4g} mm²")]
    if face.kind == "plane" and face.normal is not None:
        facts.append(("normal", direction(face.normal)))
    if shape is not None:
        facts.append(("diameter", f"{shape.diameter:.4g} mm"))
        facts.append(("axis", shape.axis_name or direction(shape.axis)))
        facts.append(("axis through", place(shape.points[0])))
        if shape.half_angle is not None:
            facts.append(("half angle", f"{shape.half_angle:.4g}°"))
    if face.span is not None:
        facts.append(("goes around by", f"{face.span:.3g}°"))
    facts.append(("centroid", place(face.centroid)))
    return tuple(facts)
