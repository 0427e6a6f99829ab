"""Parts from 3MF files: the core specification, with colours of the materials extension."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import PartError
from gradedesign.part._threemf_model import ThreemfModel, ThreemfObject
from gradedesign.part._threemf_package import read_model
from gradedesign.part.file_faces import FileFaces
from gradedesign.part.raw_triangles import RawTriangles, raw_triangles

#: The core's unit for a unit of 3MF, and how many of them it has.
_UNITS = {
    "micron": ("mm", 1e-3),
    "millimeter": ("mm", 1.0),
    "centimeter": ("cm", 1.0),
    "inch": ("inch", 1.0),
    "foot": ("inch", 12.0),
    "meter": ("m", 1.0),
}
#: Components in components no deeper than this.
_DEEPEST = 32
#: Where all components are placed, no more meshes and triangles than these.
_MOST_MESHES, _MOST_TRIANGLES = 100_000, 20_000_000


def read_3mf(path: Path) -> RawTriangles:
    """Read the triangles of all build items of a 3MF file, where they are placed.

    A face of the part is what has one colour in one placed mesh; its name is that of the object.

    Raises
    ------
    PartError
        If the file is missing, damaged, too large once unpacked, or needs an extension that is not
        read, such as the production extension.
    """
    model = ThreemfModel(path.name)
    read_model(path, model)
    if model.unit not in _UNITS:
        raise PartError(
            f"{path.name}: its unit is {model.unit!r}; expected one of {', '.join(_UNITS)}"
        )
    unit, factor = _UNITS[model.unit]
    corners, label = [np.zeros((0, 3, 3))], [np.zeros(0, dtype=np.int64)]
    names: dict[int, str] = {}
    colors: dict[int, str] = {}
    count = placed = left_out = total = 0
    for number, place in model.items:
        for part, name, where in _meshes(model, number, place, None, 0):
            placed, total = placed + 1, total + len(part.colors)
            if placed > _MOST_MESHES or total > _MOST_TRIANGLES:
                raise PartError(
                    f"{path.name}: more than {_MOST_MESHES} meshes or {_MOST_TRIANGLES} triangles "
                    "where all components are placed; export one part, or coarser"
                )
            if not part.is_solid:
                left_out += 1
                continue
            corners.append(_corners(part, where) * factor)
            shades = {reference: model.color(reference) for reference in dict.fromkeys(part.colors)}
            numbers = {shade: count + k for k, shade in enumerate(dict.fromkeys(shades.values()))}
            label.append(np.array([numbers[shades[c]] for c in part.colors], dtype=np.int64))
            count += len(numbers)
            names |= {k: name for k in numbers.values() if name is not None}
            colors |= {k: shade for shade, k in numbers.items() if shade is not None}
    faces = FileFaces(label=np.concatenate(label), names=names, colors=colors)
    return raw_triangles(
        np.concatenate(corners),
        source=path.name,
        unit=unit,
        faces=faces if names or colors or count > 1 else None,
        warnings=[f"{path.name}: {left_out} objects that are no solid left out"] * bool(left_out),
    )


def _meshes(
    model: ThreemfModel, number: str, place: FloatArray, name: str | None, depth: int
) -> Iterator[tuple[ThreemfObject, str | None, FloatArray]]:
    """Meshes of an object, their names, and where they are placed, ``(4, 3)``."""
    part = model.objects.get(number)
    if part is None:
        raise PartError(f"{model.source}: object {number} is missing; export it again")
    if depth > _DEEPEST:
        raise PartError(
            f"{model.source}: components of object {number} are nested more than {_DEEPEST} deep, "
            "or contain themselves; export the part as one object"
        )
    if not part.components:
        if not part.colors and part.is_solid:
            raise PartError(f"{model.source}: object {number} has no triangles; export it again")
        yield part, part.name or name, place
    for inner, matrix in part.components:
        turned = matrix @ place[:3]
        turned[3] += place[3]
        yield from _meshes(model, inner, turned, part.name or name, depth + 1)


def _corners(part: ThreemfObject, place: FloatArray) -> FloatArray:
    """Corners ``(m, 3, 3)`` of a mesh where it is placed; a mirrored one stays outward."""
    vertices = np.array(part.vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(part.triangles, dtype=np.int64).reshape(-1, 3)
    if np.linalg.det(place[:3]) < 0.0:
        triangles = triangles[:, ::-1]
    return np.asarray((vertices @ place[:3] + place[3])[triangles])
