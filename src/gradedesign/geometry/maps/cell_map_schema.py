"""``[lattice.cell_map]`` and ``[[lattice.warp]]``: cells that are not all alike."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from gradedesign.common.values.direction import Direction
from gradedesign.common.values.suggest import listed, shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    Number,
    Point,
    Quantity,
    Refused,
    RegionName,
    Size,
    Whole,
)

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
