"""``[part.voxels]``: what of a scanned volume is the part."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import (
    Flag,
    JsonSchema,
    Number,
    Quantity,
    Reader,
    Refused,
    Size,
    Triple,
    three,
)


class _Spacing(Reader):
    """One length, or three along x, y and z."""

    __slots__ = ()

    def read(self, value: object) -> Triple:
        length = Quantity("length", above=0.0)
        if not isinstance(value, list):
            edge = length.read(value)
            return edge, edge, edge
        x, y, z = three(value, '["0.1 mm", "0.1 mm", "0.2 mm"]')
        try:
            return length.read(x), length.read(y), length.read(z)
        except Refused as error:
            raise Refused(f"in {shown(value)}: {error}") from None

    def json_schema(self) -> JsonSchema:
        length = {**Quantity("length", above=0.0).json_schema(), "examples": ["0.1 mm"]}
        return {"anyOf": [length, {"type": "array", "items": length, "minItems": 3, "maxItems": 3}]}


class VoxelsSpec(Table):
    """Voxels of a scan that are solid, and how far their surface may be smoothed."""

    example: ClassVar[str] = '{threshold = 1200.0, spacing = "0.1 mm"}'

    threshold: Annotated[float | None, Number()] = Field(default=None, examples=[1200.0])
    """Voxels above it are solid; of true and false, true without it."""
    below: Annotated[bool, Flag()] = False
    """Whether voxels below the threshold are solid instead."""
    spacing: Annotated[Triple | None, _Spacing()] = None
    """Edges of a voxel, mm; may be left out where the file has them."""
    tolerance: Size | None = Field(default=None, examples=["0.05 mm"])
    """How far smoothing may move the surface of the voxels, mm; half of their shortest edge by
    default."""
