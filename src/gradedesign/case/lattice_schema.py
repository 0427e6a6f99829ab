"""``[lattice]`` and ``[print]``: which cells fill the part, and what the printer can make."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Field, model_validator

from gradedesign.case.regions_schema import direction_vector
from gradedesign.case.suggest import instead, shown
from gradedesign.case.table import Table, key_error
from gradedesign.case.value_types import (
    Choice,
    Direction,
    JsonSchema,
    Name,
    Number,
    Point,
    Quantity,
    Reader,
    Refused,
    RegionName,
    Size,
    Triple,
    Vector,
)


class _CellSize(Reader):
    """One length; a range is known but not there yet."""

    __slots__ = ()

    def read(self, value: object) -> float:
        if isinstance(value, list):
            raise Refused(
                "found a range, and graded cell size is not there yet; expected one length such "
                'as "8 mm"'
            )
        return Quantity("length", above=0.0).read(value)

    def json_schema(self) -> JsonSchema:
        return Quantity("length").json_schema()


class DensityRange(Reader):
    """``[lowest, highest]`` relative density."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        """Convert ``[0.10, 0.65]``."""
        if not isinstance(value, list) or len(value) != 2:
            raise Refused(
                f"found {shown(value)}; expected the lowest and the highest relative density "
                "such as [0.10, 0.65]"
            )
        low, high = (Number(above=0.0, below=1.0).read(v) for v in value)
        if low > high:
            raise Refused(
                f"found [{low:g}, {high:g}], the lowest above the highest; expected "
                f"[{high:g}, {low:g}]"
            )
        return low, high

    def json_schema(self) -> JsonSchema:
        """Two numbers."""
        item = Number(above=0.0, below=1.0).json_schema()
        return {"type": "array", "items": item, "minItems": 2, "maxItems": 2}


class _Skin(Reader):
    """``{thickness = "2 mm"}`` or ``"none"``."""

    __slots__ = ()

    def read(self, value: object) -> float | None:
        if value == "none":
            return None
        if not isinstance(value, dict):
            raise Refused(f'found {shown(value)}; expected {{thickness = "2 mm"}} or "none"')
        if "net" in value:
            raise Refused('found net, not there yet; expected {thickness = "2 mm"} or "none"')
        wrong = [key for key in value if key != "thickness"]
        if wrong or not value:
            found = f"the unknown key {shown(wrong[0])}" if wrong else "an empty table"
            guess = instead(wrong[0] if wrong else "", ["thickness"], what="valid keys")
            raise Refused(f"found {found}; {guess}")
        return Quantity("length", above=0.0).read(value["thickness"])

    def json_schema(self) -> JsonSchema:
        table = {
            "type": "object",
            "properties": {"thickness": Quantity("length").json_schema()},
            "required": ["thickness"],
            "additionalProperties": False,
        }
        return {"anyOf": [{"const": "none"}, table]}


class Parameters(Reader):
    """Plain numbers by name."""

    __slots__ = ()

    def read(self, value: object) -> dict[str, float]:
        """Convert ``{offset = 0.2}``."""
        if not isinstance(value, dict):
            raise Refused(f"found {shown(value)}; expected a table such as {{offset = 0.2}}")
        numbers = {}
        for key, entry in value.items():
            try:
                numbers[key] = Number().read(entry)
            except Refused as error:
                raise Refused(f"{key}: {error}") from None
        return numbers

    def json_schema(self) -> JsonSchema:
        """A table of numbers."""
        return {"type": "object", "additionalProperties": {"type": "number"}}


#: Keys of a lattice whose density is stated rather than found.
STATED = ("density_map", "transition", "cell_map", "warp", "wall")

_Density: TypeAlias = Annotated[tuple[float, float], DensityRange()]


class CellsSpec(Table):
    """The cells that fill the part, apart from their size and density."""

    cell: Name = Field(examples=["gyroid-sheet"])
    """Name of a cell family."""
    parameters: Annotated[dict[str, float], Parameters()] = Field(default_factory=dict)
    """Parameters of the cell family by name."""
    law: Name = "auto"
    """Name of a scaling law, or auto."""
    skin: Annotated[float | None, _Skin()] = None
    """Thickness of a solid skin in mm, or None."""
    filter_radius: Annotated[float, Number(at_least=0.0, at_most=100.0)] = 1.0
    """Radius of the density filter, in cells."""
    origin: Point = (0.0, 0.0, 0.0)
    """Corner of a cell, mm."""
    rotation: Annotated[Triple, Vector("angle")] = (0.0, 0.0, 0.0)
    """Degrees about x, then the turned y, then the twice turned z (intrinsic xyz): the cell's axes
    are the columns of Rx(a) Ry(b) Rz(c), scipy's ``Rotation.from_euler("XYZ", ...)``."""


class LatticeSpec(CellsSpec):
    """The lattice that fills the part, its density to be found."""

    size: Annotated[float, _CellSize()] = Field(examples=["8 mm"])
    """Edge length of a cell, mm."""
    grading: Annotated[
        str, Choice(("uniform", "level"), planned=("thickness", "size", "ratio"))
    ] = "level"
    """uniform: one density everywhere; level: the density follows the stress."""
    density: _Density = (0.01, 0.99)
    """Lowest and highest relative density the user allows; the windows of the family and of its
    law narrow it further."""

    @model_validator(mode="before")
    @classmethod
    def _nothing_stated(cls, value: Any) -> Any:
        for key in STATED if isinstance(value, dict) else ():
            if key in value:
                raise key_error(
                    key,
                    "belongs to `gradedesign generate`; `gradedesign run` and `check` find the "
                    "density themselves, in uniform cells of one family: leave it out",
                )
        return value


class PrintSpec(Table):
    """What the printer can make."""

    min_wall: Size = Field(examples=["0.8 mm"])
    """Thinnest wall or strut, mm."""
    build_direction: Direction = "+z"
    """Direction in which layers are added."""

    @property
    def build_vector(self) -> Triple:
        """Unit vector of the build direction."""
        return direction_vector(self.build_direction)


class KeepSpec(Table):
    """A region that stays solid, grown by a margin."""

    region: RegionName = Field(examples=["bolts"])
    """Name of the region."""
    margin: Annotated[float, Quantity("length", at_least=0.0)] = Field(examples=["3 mm"])
    """Depth of solid material around the region, mm."""
