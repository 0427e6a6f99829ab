"""Objects and build items of a 3MF model, as far as they have been parsed."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

from gradedesign.fields import FloatArray
from gradedesign_formats._threemf_id import ResourceId
from gradedesign_formats._threemf_metadata import StatedBody


@dataclass(slots=True, kw_only=True)
class ThreemfMarks:
    """Statements about an object or a build item beside its shape.

    Attributes
    ----------
    label : str
        What it is, for messages.
    roles : dict of str to bool
        Whether each piece of Cura's metadata about roles holds.
    """

    label: str
    printable: bool
    roles: dict[str, bool] = field(default_factory=dict)


@dataclass(slots=True, kw_only=True)
class ThreemfObject:
    """A mesh or an assembly of others.

    Attributes
    ----------
    kind : str
        Type of the core specification.
    color : (ResourceId, str) or None
        Group and index that a triangle has where it states none.
    vertices, triangles : arrays
        Three numbers each, in a row.
    colors : list of ((ResourceId, str) or None)
        Group and index of every triangle.
    volumes : list of StatedBody
        Ranges of triangles as Slic3r states them within the mesh.
    components : list of (ResourceId, (4, 3) array)
        Objects and where they are placed.
    """

    kind: str
    name: str | None
    color: tuple[ResourceId, str] | None
    marks: ThreemfMarks
    vertices: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    colors: list[tuple[ResourceId, str] | None] = field(default_factory=list)
    volumes: list[StatedBody] = field(default_factory=list)
    components: list[tuple[ResourceId, FloatArray]] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ThreemfItem:
    """An object that is built, and where: a point as a row times three rows, plus the last."""

    number: ResourceId
    place: FloatArray
    marks: ThreemfMarks
