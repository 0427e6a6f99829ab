"""``[lattice] skin`` below the part's faces, and ``[lattice.drain]``: holes through it."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BeforeValidator, Field, model_validator

from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    Flag,
    JsonSchema,
    Point,
    Quantity,
    Reader,
    Refused,
    RegionNames,
    Size,
)
from gradedesign.errors import CaseError


class DrainSpec(Table):
    """Holes by which powder leaves."""

    diameter: Size = Field(examples=["3 mm"])
    """Of every hole, mm."""
    at: tuple[Point, ...] = ()
    """Places on the part's surface, mm; without them every closed void gets one hole where it is
    widest below the surface, away from regions that are held, loaded or passive."""


#: Variables of a formula of a skin's thickness, mm.
PLACE = ("x", "y", "z")


class _Thickness(Reader):
    """One length, or the least and the largest of a varying one."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        reader = Quantity("length", above=0.0)
        if not isinstance(value, list):
            thickness = reader.read(value)
            return thickness, thickness
        if len(value) != 2:
            raise Refused(
                f"found {shown(value)}; expected one length, or the least and the largest such as "
                f'["0.8 mm", "2 mm"]'
            )
        least, most = (reader.read(v) for v in value)
        if not least < most:
            raise Refused(f"found {least:g} to {most:g} mm; expected the least thickness first")
        return least, most

    def json_schema(self) -> JsonSchema:
        length = Quantity("length", above=0.0).json_schema()
        pair = {"type": "array", "items": length, "minItems": 2, "maxItems": 2}
        return {"anyOf": [length, pair]}


class _ThicknessFormula(Reader):
    """The text of a formula in x, y and z."""

    __slots__ = ()

    def read(self, value: object) -> str:
        if not isinstance(value, str):
            raise Refused(
                f'found {shown(value)}; expected a formula such as "0.8 + 0.02 * x", the thickness '
                f"in mm at x, y and z in mm"
            )
        try:
            return parse_formula(value, variables=PLACE).text
        except CaseError as error:
            raise Refused(str(error)) from None

    def json_schema(self) -> JsonSchema:
        example = "0.8 + 0.02 * x"
        return {"type": "string", "examples": [example], "x-range": "a formula in x, y and z"}


class SkinSpec(Table):
    """A solid layer below the part's surface."""

    thickness: Annotated[tuple[float, float], _Thickness()] = Field(examples=["2 mm"])
    """Depth of solid material, mm; where it varies, the least and the largest."""
    formula: Annotated[str | None, _ThicknessFormula()] = None
    """Thickness in mm, in x, y and z, in mm."""
    follows: Annotated[str | None, Choice(("stress",))] = None
    """stress: as the von Mises stress of the fully solid part, from the least thickness where there
    is none to the largest where it reaches the percentile that limits of stress judge."""
    faces: RegionNames = ()
    """Regions that carry the skin; the whole surface without."""
    net: Annotated[bool, Flag()] = False
    """Whether only the struts below the surface are laid onto it, instead of a closed layer."""
    net_depth: Size | None = Field(default=None, examples=["4 mm"])
    """Depth down to which struts are laid onto the surface, mm; one cell without."""

    @model_validator(mode="after")
    def _range_where_it_varies(self) -> SkinSpec:
        ranged = self.thickness[0] < self.thickness[1]
        if self.net_depth is not None and not self.net:
            raise key_error("net_depth", "needs net = true")
        for key in ("formula", "follows"):
            if self.net and getattr(self, key) is not None:
                raise key_error(key, f"a net-skin has one thickness; leave the {key} out")
        if self.formula is not None and self.follows is not None:
            raise key_error("follows", "a formula gives the thickness already; leave one out")
        if ranged and self.formula is None and self.follows is None:
            raise key_error(
                "thickness",
                'a range needs a formula or follows = "stress", or expected one length',
            )
        varies = "a formula" if self.formula is not None else f'follows = "{self.follows}"'
        if not ranged and (self.formula is not None or self.follows is not None):
            raise key_error(
                "thickness",
                f"found {self.thickness[0]:g} mm with {varies}; expected the least and the "
                f'largest thickness that it gives, such as ["0.8 mm", "2 mm"]',
            )
        return self


def _as_tables(value: Any) -> Any:
    """The list of tables that ``"2 mm"``, ``"none"`` or one table stands for."""
    if value == "none":
        return ()
    if isinstance(value, str):
        return ({"thickness": value},)
    if isinstance(value, dict):
        return (value,)
    if isinstance(value, list | tuple):
        return value
    raise Refused(f'found {shown(value)}; expected a thickness such as "2 mm", a table or "none"')


SkinSpecs: TypeAlias = Annotated[
    tuple[SkinSpec, ...],
    BeforeValidator(
        _as_tables, json_schema_input_type=Size | Literal["none"] | SkinSpec | list[SkinSpec]
    ),
]
