"""Places by volume, which zones and passive solids have in common."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, field_validator, model_validator

from gradedesign.common.values.direction import Direction
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    FilePath,
    JsonSchema,
    Name,
    Point,
    Quantity,
    Reader,
    Refused,
    RegionName,
    Size,
    Triple,
    Vector,
)
from gradedesign.geometry.part.part_schema import UNITS, part_file
from gradedesign.geometry.part.regions_schema import BoxSpec

#: Keys of a place that state a volume.
VOLUMES = ("box", "cylinder", "body")


class _Ends(Reader):
    """Two different points."""

    __slots__ = ()

    def read(self, value: object) -> tuple[Triple, Triple]:
        if not isinstance(value, list) or len(value) != 2:
            raise Refused(
                f"found {shown(value)}; expected the middles of both ends such as "
                '[["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "20 mm"]]'
            )
        first, second = (Vector("length").read(end) for end in value)
        if first == second:
            raise Refused(f"found {shown(value)}, twice the same point; expected two")
        return first, second

    def json_schema(self) -> JsonSchema:
        point = Vector("length").json_schema()
        example = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "20 mm"]]
        pair = {"type": "array", "items": point, "minItems": 2, "maxItems": 2}
        return {**pair, "examples": [example]}


class CylinderVolume(Table):
    """All within half the diameter of an axis, between its ends where they are stated."""

    example: ClassVar[str] = '{diameter = "20 mm", point = ["30 mm", "10 mm", "0 mm"]}'

    diameter: Size = Field(examples=["20 mm"])
    """Diameter, mm."""
    ends: Annotated[tuple[Triple, Triple] | None, _Ends()] = None
    """Middles of both ends, mm; infinite without them."""
    point: Point | None = None
    """A point of the axis of an infinite one, mm."""
    axis: Direction | None = None
    """Direction of the axis of an infinite one; +z without it."""

    @model_validator(mode="after")
    def _one_axis(self) -> CylinderVolume:
        if (self.ends is None) == (self.point is None):
            stated = "neither" if self.ends is None else "both"
            raise Refused(
                f"found {stated} of ends and point; expected ends = [[...], [...]], or, without "
                f"ends, a point of the axis"
            )
        if self.ends is not None and self.axis is not None:
            raise key_error("axis", "has no meaning with ends, which state it")
        return self


class BodySpec(Table):
    """A body of the part by a region on it, or a closed body from a file of its own."""

    example: ClassVar[str] = '{region = "insert"}'

    region: RegionName | None = None
    """Name of a region with faces of the bodies of the part that are meant."""
    file: FilePath | None = Field(default=None, examples=["insert.stl"])
    """File of a closed surface in the part's coordinates; its absolute path once read."""
    units: Annotated[str, Choice(UNITS)] | None = None
    """Unit of the coordinates of the file; may be left out where its format carries one."""

    @field_validator("file", mode="before")
    @classmethod
    def _find_file(cls, value: Any, info: ValidationInfo) -> Path:
        return part_file(value, info)

    @model_validator(mode="after")
    def _one_source(self) -> BodySpec:
        if (self.region is None) == (self.file is None):
            stated = "neither" if self.file is None else "both"
            raise Refused(
                f'found {stated} of region and file; expected region = "insert", a region on a '
                f'body of the part, or file = "insert.stl"'
            )
        if self.file is None and self.units is not None:
            raise key_error("units", "goes with file")
        return self


class PlaceSpec(Table):
    """A place by volume."""

    name: Name | None = Field(default=None, examples=["root"])
    """Shown in check, pictures and messages; a number without it."""
    box: BoxSpec | None = None
    """All in this box."""
    cylinder: CylinderVolume | None = None
    """All in this cylinder."""
    body: BodySpec | None = None
    """All in this body."""

    @property
    def volume_key(self) -> str | None:
        """Name of the key of `VOLUMES` that states the place; None without one."""
        return next((key for key in VOLUMES if getattr(self, key) is not None), None)


class KeepSpec(PlaceSpec):
    """A passive solid: all within a margin of a region's faces, or a volume."""

    called: ClassVar[Mapping[str, str]] = {
        "thickness": "margin",
        "depth": "margin",
        "within": "margin",
    }

    region: RegionName | None = Field(default=None, examples=["bolts"])
    """Name of the region."""
    margin: Annotated[float, Quantity("length", at_least=0.0)] | None = Field(
        default=None, examples=["3 mm"]
    )
    """Depth of solid material at the region; by how much a volume is grown, 0 without it, mm."""

    @model_validator(mode="after")
    def _one_place(self) -> KeepSpec:
        require_one(self, ("region", *VOLUMES))
        if self.region is not None and not self.margin:
            raise key_error("margin", 'is needed with region, such as margin = "3 mm"')
        return self


def require_one(table: Table, keys: tuple[str, ...]) -> None:
    """Refuse a table that states none or several of these keys.

    Raises `Refused`.
    """
    stated_keys = [key for key in keys if getattr(table, key) is not None]
    if len(stated_keys) != 1:
        stated = "none" if not stated_keys else " and ".join(stated_keys)
        raise Refused(f"found {stated}; expected exactly one of {', '.join(keys)}")
