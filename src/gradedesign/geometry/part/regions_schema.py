"""``[region.NAME]``: which smooth faces of the part a name stands for.

Every key of a region must hold (they are ANDed). A face here is a smooth face: a patch of
triangles without a sharp edge inside, such as one side of a box or the wall of one hole.
Above 300 lines: the keys of one table of the case file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from gradedesign.common.values.direction import Facing
from gradedesign.common.values.quantity import parse_quantity
from gradedesign.common.values.suggest import instead, nearest, shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    Flag,
    JsonSchema,
    Number,
    Point,
    Quantity,
    Reader,
    Refused,
    RegionNames,
    Text,
    Triple,
    Whole,
    three,
)
from gradedesign.errors import CaseError

AXES = ("x", "y", "z")
_PLANE_TEXT = re.compile(r"\s*(?P<axis>\w+)\s*=\s*(?P<position>\S[^\n]*?)\s*")
_PLANE_EXAMPLE = 'plane = "x = min", plane = "z = 12 mm" or plane = {point = [...], normal = [...]}'
_RADIUS = ("radius", "diameter", "axis", "point")
_COLOR = re.compile(r"#[0-9a-fA-F]{6}")
#: Keys that ask for faces as the part's file tells them apart.
FILE_KEYS = ("face", "name", "color")
_SELECTING = (
    *("plane", "box", "cylinder", "cone", "slot", "facing", "nearest", "inside"),
    *(*FILE_KEYS, "any", "all", "not"),
)


class _Axis(Reader):
    """``x``, ``y`` or ``z`` to 0, 1 or 2."""

    __slots__ = ()

    def read(self, value: object) -> int:
        return AXES.index(str(Choice(AXES).read(value)))

    def json_schema(self) -> JsonSchema:
        return {"enum": list(AXES)}


class _Position(Reader):
    """``min``, ``max`` or a coordinate."""

    __slots__ = ()

    def read(self, value: object) -> float | str:
        if value in ("min", "max"):
            return str(value)
        try:
            return Quantity("length").read(value)
        except Refused as error:
            raise Refused(f"{error}, or min or max") from None

    def json_schema(self) -> JsonSchema:
        length = Quantity("length").json_schema()
        return {
            **length,
            "examples": ["min", "max", "12 mm"],
            "x-range": "min, max or a coordinate",
        }


@dataclass(frozen=True, slots=True)
class _Normal(Reader):
    """Three plain numbers, not all zero, to a unit vector."""

    def read(self, value: object) -> Triple:
        x, y, z = (Number().read(v) for v in three(value, "[0, 0, 1]"))
        largest = max(abs(x), abs(y), abs(z))
        if largest == 0.0:
            raise Refused("found a direction of length zero; expected one such as [0, 0, 1]")
        x, y, z = x / largest, y / largest, z / largest
        length = (x * x + y * y + z * z) ** 0.5
        return x / length, y / length, z / length

    def json_schema(self) -> JsonSchema:
        three_of = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        return {**three_of, "examples": [[0, 0, 1]], "x-range": "not all of them 0"}


class _FaceNumbers(Reader):
    """One number of a face, or a list of different ones."""

    __slots__ = ()

    def read(self, value: object) -> tuple[int, ...]:
        entries = value if isinstance(value, list) else [value]
        if not entries:
            raise Refused(f"found {shown(value)}; expected a number such as 3, or a list of some")
        numbers = tuple(Whole(0, 2**31 - 1).read(entry) for entry in entries)
        if len(set(numbers)) != len(numbers):
            raise Refused(f"found {shown(value)}; expected each number once")
        return numbers

    def json_schema(self) -> JsonSchema:
        number = {"type": "integer", "minimum": 0}
        several = {"type": "array", "items": number, "minItems": 1, "uniqueItems": True}
        return {"anyOf": [number, several], "examples": [3]}


class _Color(Reader):
    """``#rrggbb`` in lower case."""

    __slots__ = ()

    def read(self, value: object) -> str:
        if not (isinstance(value, str) and _COLOR.fullmatch(value)):
            raise Refused(f'found {shown(value)}; expected a colour such as "#ff0000"')
        return value.lower()

    def json_schema(self) -> JsonSchema:
        return {
            "type": "string",
            "pattern": f"^{_COLOR.pattern}$",
            "examples": ["#ff0000"],
            "x-range": "`#000000` to `#ffffff`",
        }


@dataclass(frozen=True, slots=True)
class _Range(Reader):
    """One quantity to itself twice, or a list of two in rising order."""

    kind: str
    word: str
    low: str
    high: str

    def read(self, value: object) -> tuple[float, float]:
        quantity = Quantity(self.kind, above=0.0)
        if not isinstance(value, list):
            stated = quantity.read(value)
            return stated, stated
        if len(value) != 2:
            raise Refused(
                f'found {shown(value)}; expected one {self.word} such as "{self.low}", or the '
                f'smallest and the largest, ["{self.low}", "{self.high}"]'
            )
        least, most = (quantity.read(entry) for entry in value)
        if least > most:
            raise Refused(f"found {shown(value)}; expected the smaller {self.word} first")
        return least, most

    def json_schema(self) -> JsonSchema:
        quantity = Quantity(self.kind, above=0.0).json_schema()
        pair = {"type": "array", "items": quantity, "minItems": 2, "maxItems": 2}
        return {"anyOf": [quantity, pair], "examples": [self.low, [self.low, self.high]]}


_Diameters = _Range("length", "diameter", "8 mm", "10 mm")

AxisIndex: TypeAlias = Annotated[int, _Axis()]


class PlaneSpec(Table):
    """Flat faces that lie on a plane: ``"x = min"``, ``"z = 12 mm"`` or point and normal.

    Either ``axis`` and ``position`` are set, or ``point`` and ``normal``.
    """

    axis: AxisIndex | None = None
    """The coordinate that is constant on the plane; 0, 1 or 2 once read."""
    position: Annotated[float | Literal["min", "max"], _Position()] | None = None
    """Coordinate in mm, or that side of the part's bounding box."""
    point: Point | None = None
    """A point of the plane, mm."""
    normal: Annotated[Triple, _Normal()] | None = None
    """Unit normal of the plane, either sense."""

    @model_validator(mode="after")
    def _complete(self) -> PlaneSpec:
        is_stated = tuple(
            v is not None for v in (self.axis, self.position, self.point, self.normal)
        )
        if is_stated not in ((True, True, False, False), (False, False, True, True)):
            raise Refused(f"not a complete plane; expected {_PLANE_EXAMPLE}")
        return self


class BoxSpec(Table):
    """An axis-aligned box."""

    called: ClassVar[Mapping[str, str]] = {
        "min": "lower",
        "max": "upper",
        "minimum": "lower",
        "maximum": "upper",
    }

    lower: Point = Field(examples=[["0 mm", "0 mm", "0 mm"]])
    """Corner of the smallest coordinates, mm."""
    upper: Point = Field(examples=[["10 mm", "10 mm", "10 mm"]])
    """Corner of the largest coordinates, mm."""

    @model_validator(mode="after")
    def _ordered(self) -> BoxSpec:
        for axis, low, high in zip(AXES, self.lower, self.upper, strict=True):
            if not low < high:
                raise key_error(
                    "upper",
                    f"found {axis} = {high:g} mm; expected more than lower's {low:g} mm",
                )
        return self


class CylinderSpec(Table):
    """Cylindrical faces, narrowed by whatever is given; an empty table takes every cylinder."""

    called: ClassVar[Mapping[str, str]] = {
        "d": "diameter",
        "centre": "point",
        "center": "point",
    }
    example: ClassVar[str] = '{diameter = "8 mm"}'

    diameter: Annotated[tuple[float, float] | None, _Diameters] = None
    """One diameter, or the smallest and the largest that count, mm."""
    axis: Annotated[str, Choice(AXES)] | None = None
    """Direction of the axis: x, y or z."""
    point: Point | None = None
    """A point on the axis, mm."""
    span: Annotated[tuple[float, float] | None, _Range("angle", "span", "180 deg", "360 deg")] = (
        None
    )
    """How far the face goes around its axis, degrees: 180 half bores and round ends of slots, 360
    whole holes; one value within 30 degrees, or the smallest and the largest that count."""

    @model_validator(mode="before")
    @classmethod
    def _not_the_radius(cls, value: Any) -> Any:
        for key in value if isinstance(value, dict) else ():
            if key not in cls.model_fields and (key == "r" or nearest(key, _RADIUS) == "radius"):
                raise key_error(
                    key,
                    f"a cylinder is found by its diameter, twice the radius; write "
                    f"{_diameter_words(value[key])} instead",
                )
        return value


class ConeSpec(Table):
    """Conical faces, narrowed by whatever is given; an empty table takes every cone."""

    called: ClassVar[Mapping[str, str]] = {"centre": "point", "center": "point"}
    example: ClassVar[str] = '{half_angle = "45 deg"}'

    half_angle: Annotated[
        tuple[float, float] | None, _Range("angle", "half angle", "45 deg", "60 deg")
    ] = None
    """Angle between axis and side, within 1 degree, or the smallest and the largest that count."""
    diameter: Annotated[tuple[float, float] | None, _Diameters] = None
    """Where the cone is widest: one diameter, or the smallest and the largest that count, mm."""
    axis: Annotated[str, Choice(AXES)] | None = None
    """Direction of the axis: x, y or z."""
    point: Point | None = None
    """A point on the axis, mm."""

    @model_validator(mode="before")
    @classmethod
    def _not_the_whole_angle(cls, value: Any) -> Any:
        if isinstance(value, dict) and "angle" in value:
            raise key_error(
                "angle",
                "a cone is found by its half angle, between axis and side; write "
                f"{_half_angle_words(value['angle'])} instead",
            )
        return value


class SlotSpec(Table):
    """Faces of slots with round ends, narrowed by whatever is given; an empty table takes all.

    The ends and the flat sides between them are faces of a slot, mostly four.
    """

    example: ClassVar[str] = '{width = "6 mm"}'

    width: Annotated[tuple[float, float] | None, _Range("length", "width", "6 mm", "8 mm")] = None
    """One width, or the smallest and the largest that count, mm."""
    length: Annotated[tuple[float, float] | None, _Range("length", "length", "20 mm", "30 mm")] = (
        None
    )
    """Over the round ends: one length, or the smallest and the largest that count, mm."""
    axis: Annotated[str, Choice(AXES)] | None = None
    """Direction across width and length, in which the slot is cut: x, y or z."""


def _split_text(value: Any) -> Any:
    """The table that a text such as ``"x = min"`` stands for."""
    if not isinstance(value, str):
        return value
    match = _PLANE_TEXT.fullmatch(value) if len(value) <= 80 else None
    if match is None:
        raise Refused(f"found {shown(value)}; expected {_PLANE_EXAMPLE}")
    return {"axis": match["axis"], "position": match["position"]}


_PlaneText: TypeAlias = Annotated[
    str, WithJsonSchema({"type": "string", "x-range": 'such as "x = min" or "z = 12 mm"'})
]
AnyPlane: TypeAlias = Annotated[
    PlaneSpec, BeforeValidator(_split_text, json_schema_input_type=_PlaneText | PlaneSpec)
]


class RegionSpec(Table):
    """A named set of smooth faces; every key given must hold."""

    called: ClassVar[Mapping[str, str]] = {
        "hole": "cylinder",
        "bore": "cylinder",
        "countersink": "cone",
        "normal": "facing",
        "direction": "facing",
        "tolerance": "area_tolerance",
        "colour": "color",
    }

    plane: AnyPlane | None = Field(default=None, examples=["x = min"])
    """Flat faces on this plane."""
    box: BoxSpec | None = None
    """Faces that lie in this box with every corner; with ``clip`` what it cuts out of any face."""
    cylinder: CylinderSpec | None = None
    """Cylindrical faces."""
    cone: ConeSpec | None = None
    """Conical faces: countersinks, tapers, tips of drilled holes."""
    slot: SlotSpec | None = None
    """Faces of slots with round ends."""
    facing: Facing | None = None
    """Faces whose mean outward normal points this way, within ``angle``."""
    angle: Annotated[float, Quantity("angle", above=0.0)] = 15.0
    """Angle around ``facing``, degrees."""
    nearest: Point | None = None
    """Of the faces that pass the other keys, the one nearest to this point, mm."""
    inside: BoxSpec | None = None
    """Faces whose centroid lies in this box."""
    face: Annotated[tuple[int, ...], _FaceNumbers()] = ()
    """Triangles of these faces of the part's file, by their numbers there."""
    name: Annotated[str, Text("the name of a face or body", 120, "FLANGE")] | None = None
    """Triangles of the faces with this name in the part's file."""
    color: Annotated[str, _Color()] | None = None
    """Triangles of the faces with this colour in the part's file."""
    any: RegionNames = ()
    """Faces of at least one of these regions."""
    all: RegionNames = ()
    """Faces of every one of these regions."""
    not_: RegionNames = Field(default=(), alias="not")
    """Not the faces of these regions."""
    clip: Annotated[bool, Flag()] = False
    """Cut faces by ``box`` instead of taking those that lie in it whole."""
    count: Annotated[int, Whole(1, 100_000)] | None = Field(default=None, examples=[4])
    """Assertion: exactly this many faces."""
    area: Annotated[float, Quantity("area", above=0.0)] | None = None
    """Assertion: total area in mm^2, within ``area_tolerance``."""
    area_tolerance: Annotated[float, Number(above=0.0, below=1.0)] = 0.05
    """Relative tolerance of ``area``."""

    @property
    def facing_vector(self) -> Triple | None:
        """Unit vector of ``facing``."""
        return None if self.facing is None else direction_vector(self.facing)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the other regions this one is made of."""
        return (*self.any, *self.all, *self.not_)

    @model_validator(mode="after")
    def _meaningful(self) -> RegionSpec:
        stated_keys = self.model_fields_set
        if not stated_keys & {*_SELECTING, "not_"}:
            raise Refused(f"the region selects nothing; {instead('', _SELECTING, label='use')}")
        if "angle" in stated_keys and self.facing is None:
            raise key_error("angle", 'has no meaning without facing; add e.g. facing = "+x"')
        if self.angle > 90.0:
            raise key_error("angle", f"found {self.angle:g} deg; expected at most 90 deg")
        if self.clip and self.box is None:
            raise key_error("clip", "has no meaning without box; add box = {lower, upper}")
        if "area_tolerance" in stated_keys and self.area is None:
            raise key_error("area_tolerance", "has no meaning without area")
        return self


def _diameter_words(radius: object) -> str:
    """The key ``diameter`` for a radius that was written, where that can be read."""
    try:
        return f'diameter = "{2 * parse_quantity(radius, "length"):g} mm"'
    except CaseError:
        return 'diameter = "8 mm", say,'


def _half_angle_words(angle: object) -> str:
    """The key ``half_angle`` for an included angle that was written, where that can be read."""
    try:
        return f'half_angle = "{0.5 * parse_quantity(angle, "angle"):g} deg"'
    except CaseError:
        return 'half_angle = "45 deg", say,'


def direction_vector(direction: str) -> Triple:
    """Unit vector of ``"+x"`` to ``"-z"``.

    Examples
    --------
    >>> direction_vector("-z")
    (0.0, 0.0, -1.0)
    """
    sign = -1.0 if direction[0] == "-" else 1.0
    x, y, z = (sign if axis == direction[1] else 0.0 for axis in AXES)
    return x, y, z
