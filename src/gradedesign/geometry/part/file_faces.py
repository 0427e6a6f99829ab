"""Faces and bodies that a part file tells apart: numbers, names, colours, roles."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.errors import PartError
from gradedesign.geometry.part.exact_surface import ExactSurface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points
from gradedesign.geometry.triangles.triangle_tree import build_triangle_tree, closest_features

#: Label of a triangle that belongs to no face of the file.
NO_FACE = -1
_COLOR = re.compile(r"#[0-9a-f]{6}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FileFaces:
    """Face of every triangle, as the file numbers, names and colours them.

    Attributes
    ----------
    label : (m,) int array
        Number of the face of every triangle; -1 where it has none.
    names : mapping of int to str
        Names of faces, or of the bodies or groups that they belong to.
    colors : mapping of int to str
        ``#rrggbb``, lower case.
    surfaces : mapping of int to ExactSurface
        Of every face, where the format has exact ones; lengths in file units.
    """

    label: IntArray
    names: Mapping[int, str] = field(default_factory=dict)
    colors: Mapping[int, str] = field(default_factory=dict)
    surfaces: Mapping[int, ExactSurface] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lock(self, dtype=np.int64, label=(None,))
        if self.label.size and self.label.min() < NO_FACE:
            raise ValueError(f"a face has the number {self.label.min()}; expected 0 or more")
        for number, name in self.names.items():
            if not isinstance(name, str) or not name.strip():
                raise ValueError(f"face {number} has the name {name!r}; expected a text")
        for number, color in self.colors.items():
            if not isinstance(color, str) or not _COLOR.fullmatch(color):
                raise ValueError(f"face {number} has the colour {color!r}; expected #rrggbb")
        object.__setattr__(self, "names", MappingProxyType(dict(self.names)))
        for number, surface in self.surfaces.items():
            if not isinstance(surface, ExactSurface):
                raise TypeError(f"face {number} has surface {surface!r}; expected ExactSurface")
        object.__setattr__(self, "colors", MappingProxyType(dict(self.colors)))
        object.__setattr__(self, "surfaces", MappingProxyType(dict(self.surfaces)))

    def scaled(self, factor: float) -> FileFaces:
        """The same faces in another unit."""
        surfaces = {n: surface.scaled(factor) for n, surface in self.surfaces.items()}
        return replace(self, surfaces=surfaces)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the faces, rising."""
        return tuple(n for n in np.unique(self.label).tolist() if n != NO_FACE)

    def places(self, surface: SurfaceMesh) -> dict[int, tuple[float, FloatArray]]:
        """Area, mm^2, and centroid, mm, of every face on the surface that the labels belong to."""
        area = np.linalg.norm(area_vectors(surface), axis=1)
        moment = area[:, None] * corner_points(surface).mean(axis=1)
        result = {}
        for number in self.numbers:
            own = self.label == number
            total = float(area[own].sum())
            result[number] = total, moment[own].sum(axis=0) / max(total, 1e-300)
        return result


def require_labels(faces: FileFaces | None, count: int, source: str) -> None:
    """Refuse labels of another number than there are triangles."""
    if faces is not None and len(faces.label) != count:
        raise PartError(
            f"{source}: {len(faces.label)} triangles have a face, but there are {count} triangles; "
            "the file is damaged or its reader wrong"
        )


def carried(
    faces: FileFaces, corners: FloatArray, surface: SurfaceMesh, *, tolerance: float
) -> FileFaces:
    """Faces of the file on the repaired surface.

    Repair welds, flips, splits and unites triangles but leaves them where they were: each takes
    the face of the file's triangle beneath its centroid.

    - ``faces``: of ``corners``
    - ``corners (m, 3, 3)``, mm: triangles as they were read
    - ``surface``: the surface after repair
    - ``tolerance``, mm: farther from any of them, as in a hole that was filled, a triangle has no
      face
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    solid = np.flatnonzero(np.cross(b - a, c - a).any(axis=1))
    nearest = closest_features(
        build_triangle_tree(corners[solid]), corner_points(surface).mean(axis=1).T
    )
    label = faces.label[solid][nearest.triangle]
    label = np.where(nearest.distance <= tolerance, label, NO_FACE)
    face_numbers = set(np.unique(label).tolist())
    return FileFaces(
        label=label,
        names={n: name for n, name in faces.names.items() if n in face_numbers},
        colors={n: color for n, color in faces.colors.items() if n in face_numbers},
        surfaces={n: surface for n, surface in faces.surfaces.items() if n in face_numbers},
    )


#: Names in one text; result.json and the report have all. Chosen, not measured.
_MOST_NAMES = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class FileBody:
    """A body that is subtracted from the part or left out of it.

    Attributes
    ----------
    name : str
        Of the body or its object in the file.
    role : str
        Such as ``negative volume``, ``parameter modifier``, ``not printable``.
    """

    name: str
    role: str
    #: Role of a body that takes material away from those before it.
    NEGATIVE: ClassVar[str] = "negative volume"

    @property
    def done(self) -> str:
        """``subtracted`` or ``left out``."""
        return "subtracted" if self.role == self.NEGATIVE else "left out"

    def __str__(self) -> str:
        return f"'{self.name}' ({self.role})"


def file_body_words(bodies: Sequence[FileBody]) -> list[str]:
    """One text for the bodies that are subtracted, one for those that are left out."""
    words = []
    for done in ("subtracted", "left out"):
        found = [str(body) for body in bodies if body.done == done]
        if found:
            more = len(found) - _MOST_NAMES
            listed = ", ".join(found[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
            words.append(f"bodies {done}: {listed}")
    return words


def file_body_data(bodies: Sequence[FileBody]) -> tuple[dict[str, str], ...]:
    """Plain data of result.json and ``check --json``."""
    return tuple({"name": body.name, "role": body.role, "done": body.done} for body in bodies)
