"""Tables of ``[lattice]`` on cells that differ: ``size``, ``cell_map``, ``[[warp]]``."""

from __future__ import annotations

import re
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from gradedesign.common.values.direction import Direction
from gradedesign.common.values.suggest import listed, shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    JsonSchema,
    Number,
    Point,
    Quantity,
    Reader,
    Refused,
    RegionName,
    Size,
    Whole,
)

#: Edges of a cell, mm: from what the finest printers draw to what fills a room. Chosen, not
#: measured.
_CELL_SPAN = (1e-3, 1e5)


#: A range as people write it: "4-8 mm", "4 to 8 mm".
_RANGE = re.compile(
    r"\s*(?P<low>[\d.]{1,9})\s*(?:-|to|\.\.)\s*(?P<high>[\d.]{1,9})\s*(?P<unit>[a-z]{1,6})\s*"
)


class CellSize(Reader):
    """One length, a range, or the three edges of the cell."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, ...]:
        """Convert ``"8 mm"``, ``["40 mm", "50 mm"]`` or ``["8 mm", "8 mm", "12 mm"]``."""
        reader = Quantity("length", at_least=_CELL_SPAN[0], at_most=_CELL_SPAN[1])
        if isinstance(value, str) and (ends := _RANGE.fullmatch(value)):
            unit = ends["unit"]
            raise Refused(
                f"found {shown(value)}, which is no length; expected one, or a range as a list: "
                f'["{ends["low"]} {unit}", "{ends["high"]} {unit}"]'
            )
        if not isinstance(value, list):
            return (reader.read(value),)
        if len(value) not in (2, 3):
            raise Refused(
                f"found {shown(value)}; expected one length, a range such as "
                '["40 mm", "50 mm"], or three edges such as ["8 mm", "8 mm", "12 mm"]'
            )
        lengths = tuple(reader.read(v) for v in value)
        if len(lengths) == 2 and not lengths[0] < lengths[1]:
            raise Refused(
                f"found {lengths[0]:g} to {lengths[1]:g} mm; expected the smallest size first"
            )
        return lengths

    def json_schema(self) -> JsonSchema:
        """One string, two or three."""
        length = Quantity("length", at_least=_CELL_SPAN[0], at_most=_CELL_SPAN[1]).json_schema()
        return {"anyOf": [length, {"type": "array", "items": length, "minItems": 2, "maxItems": 3}]}


#: Keys that each kind needs, and those it may have.
_KEYS = {
    "cylindrical": (("around", "inner_radius"), ("centre", "axis")),
    "spherical": (("around", "inner_radius"), ("centre", "axis", "polar_cap")),
    "conformal": ((), ("normal", "surface")),
    "layered": (("layers", "surface", "opposite"), ("normal",)),
}
_EXAMPLES = {
    "around": "24",
    "inner_radius": '"10 mm"',
    "layers": "3",
    "surface": '"root"',
    "opposite": '"tip"',
}
_ALL = tuple(dict.fromkeys(key for keys in _KEYS.values() for part in keys for key in part))


class CellMapSpec(Table):
    """Arrangement of the cells in the part."""

    example: ClassVar[str] = '{kind = "cylindrical", around = 24, inner_radius = "10 mm"}'

    kind: Annotated[str, Choice(tuple(_KEYS))] = Field(examples=["cylindrical"])
    """cylindrical: about an axis; spherical: about a centre; conformal: in layers from the
    surface; layered: a whole number of layers between two regions."""
    around: Annotated[int | None, Whole(3, 100_000)] = Field(default=None, examples=[24])
    """Cells in a turn, or along the equator; an even number there."""
    inner_radius: Size | None = None
    """Where the first layer of cells begins, mm; the part must not reach below half of it."""
    centre: Point = (0.0, 0.0, 0.0)
    """A point of the axis, or the centre, mm."""
    axis: Direction = "+z"
    """The axis, or the direction of the pole."""
    polar_cap: Annotated[float, Quantity("angle", above=0.0)] = 15.0
    """Degrees around either pole that the part must not reach."""
    normal: Direction = "+z"
    """Mean direction into the part; the cells' other axes lie across it."""
    surface: RegionName | None = None
    """Region from which layers count; the whole surface without it."""
    layers: Annotated[int | None, Whole(1, 100_000)] = Field(default=None, examples=[3])
    """Layers of cells between the two regions."""
    opposite: RegionName | None = None
    """Region at which the last layer ends."""

    @model_validator(mode="after")
    def _keys_of_kind(self) -> CellMapSpec:
        needed, allowed = _KEYS[self.kind]
        if lacking := [key for key in needed if getattr(self, key) is None]:
            raise Refused(
                f"a {self.kind} map needs {listed(lacking)}; add "
                + " and ".join(f"{key} = {_EXAMPLES[key]}" for key in lacking)
            )
        for key in _ALL:
            if key in self.model_fields_set and key not in (*needed, *allowed):
                raise key_error(key, f"has no meaning with the {self.kind} map")
        if self.surface is not None and self.surface == self.opposite:
            raise key_error(
                "opposite", f"found {shown(self.opposite)}, which is surface too; expected another"
            )
        if self.kind == "spherical" and (self.around or 0) % 2:
            raise key_error("around", f"found {self.around}; expected an even number")
        return self


class WarpSpec(Table):
    """A sphere in which cells are larger or smaller."""

    centre: Point
    """Its centre, mm."""
    stable_radius: Size = Field(examples=["8 mm"])
    """Within it all cells are magnified alike."""
    outer_radius: Size = Field(examples=["20 mm"])
    """Beyond it nothing changes."""
    magnification: Annotated[float, Number(above=0.0, at_most=10.0)] = Field(examples=[1.5])
    """Size of the cells within, over the size outside."""
