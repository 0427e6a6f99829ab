"""``[[load_case]]``: supports and loads that act together."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, TypeAlias

from pydantic import Field, model_validator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Flag,
    JsonSchema,
    Name,
    Quantity,
    Reader,
    Refused,
    RegionName,
    Triple,
    Vector,
    three,
)

Prescribed: TypeAlias = tuple[float | None, float | None, float | None]
_EXAMPLE = '["0 mm", "free", "0.1 mm"]'
_NO_RIGID = (
    "unknown key: no analysis couples a region to a point rigidly, and a remote force leaves its "
    "region free to deform; leave the key out for that, or give the part with the lever that holds "
    "the region in shape"
)


def axis_prescription(letters: str) -> Prescribed:
    """Prescription that holds the named components at zero."""
    x, y, z = (0.0 if axis in letters else None for axis in "xyz")
    return x, y, z


class _Components(Reader):
    """``"xy"`` to the prescription that holds x and y at zero."""

    __slots__ = ()

    def read(self, value: object) -> Prescribed:
        if (
            not isinstance(value, str)
            or not value
            or not set(value) <= set("xyz")
            or len(set(value)) != len(value)
        ):
            raise Refused(f'found {shown(value)}; expected letters of xyz such as "xy"')
        return axis_prescription(value)

    def json_schema(self) -> JsonSchema:
        return {
            "type": "string",
            "pattern": "^[xyz]{1,3}$",
            "examples": ["xy"],
            "x-range": "letters of xyz, each once",
        }


class _Displacement(Reader):
    """Three lengths or the word free."""

    __slots__ = ()

    def read(self, value: object) -> Prescribed:
        x, y, z = (self._component(i, v) for i, v in enumerate(three(value, _EXAMPLE)))
        if x is None and y is None and z is None:
            raise Refused(f"found three times free, which holds nothing; expected {_EXAMPLE}")
        return x, y, z

    def json_schema(self) -> JsonSchema:
        length = {**Quantity("length").json_schema(), "x-range": "positive or negative, or free"}
        three_of = {"type": "array", "items": length, "minItems": 3, "maxItems": 3}
        return {**three_of, "examples": [json.loads(_EXAMPLE)]}

    @staticmethod
    def _component(index: int, value: object) -> float | None:
        if value == "free":
            return None
        try:
            return Quantity("length").read(value)
        except Refused as error:
            raise Refused(f"entry {index + 1}: {error}, or free") from None


class FixSpec(Table):
    """A support: all of x, y, z held, some components, prescribed displacements, or symmetry."""

    called: ClassVar[Mapping[str, str]] = {
        "direction": "components",
        "axis": "components",
        "dof": "components",
        "face": "region",
        "faces": "region",
    }

    region: RegionName = Field(examples=["root"])
    """Name of the region that is held."""
    components: Annotated[Prescribed, _Components()] | None = None
    """Components held at zero, such as ``"xy"``."""
    prescribed: Annotated[Prescribed, _Displacement()] | None = Field(
        default=None, alias="displacement"
    )
    """Displacement per component in mm, or free."""
    symmetry: Annotated[bool, Flag()] = False
    """The region is a plane on which the whole part is mirrored: held in its normal alone."""

    @property
    def displacement(self) -> Prescribed:
        """Prescribed displacement along x, y, z in mm; None where the part is free to move.

        Of a plane of symmetry none until its normal is known, see `resolve.symmetry`.
        """
        if self.symmetry and self.components is None:
            return None, None, None
        return self.prescribed or self.components or (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _one_form(self) -> FixSpec:
        if self.components is not None and self.prescribed is not None:
            raise key_error(
                "components", 'found beside displacement; expected one of them, with "free"'
            )
        if self.symmetry and (self.components is not None or self.prescribed is not None):
            raise key_error(
                "symmetry",
                "found beside components or displacement; expected it alone: the plane's normal "
                "follows from the part",
            )
        return self


class LoadSpec(Table):
    """A load on a region; what is given acts together."""

    replaced: ClassVar[Mapping[str, str]] = dict.fromkeys(("coupling", "rigid"), _NO_RIGID)
    called: ClassVar[Mapping[str, str]] = {
        "torque": "moment",
        "traction": "pressure",
        "face": "region",
        "faces": "region",
    }
    example: ClassVar[str] = '{region = "tip", force = ["0 N", "0 N", "-5 kN"]}'

    region: RegionName = Field(examples=["tip"])
    """Name of the region that is loaded."""
    force: Annotated[Triple, Vector("force")] | None = None
    """Total force in N, spread over the region."""
    point: Annotated[Triple, Vector("length")] | None = None
    """Place in mm where the force acts, also off the part, such as ``["0 mm", "0 mm", "80 mm"]``.

    The region carries the force and the moment of its offset, and stays free to deform; without
    it the force acts at the region's centroid.
    """
    pressure: Annotated[float, Quantity("pressure")] | None = Field(
        default=None, examples=["2 MPa"]
    )
    """Pressure, MPa, along the inward normal: positive presses on the part."""
    moment: Annotated[Triple, Vector("moment")] | None = None
    """Total moment in N mm about the centroid of the region."""
    bearing: Annotated[Triple, Vector("force")] | None = None
    """Force in N of a pin on the bore that the region is, such as ``["0 N", "0 N", "-5 kN"]``.

    A radial pressure on the half of the wall that it presses on, with the cosine of the angle.
    """

    @property
    def is_zero(self) -> bool:
        """Whether all values of the load are zero."""
        return not any(self._values())

    @model_validator(mode="after")
    def _any_load(self) -> LoadSpec:
        if self.point is not None and self.force is None:
            raise key_error(
                "point",
                'found without force; expected the force that acts there, such as force = ["0 N", '
                '"0 N", "-5 kN"]',
            )
        if all(v is None for v in (self.force, self.pressure, self.moment, self.bearing)):
            raise Refused(
                'no load given; add force = ["0 N", "0 N", "-5 kN"], pressure = "2 MPa", '
                'moment = ["0 N*m", "0 N*m", "20 N*m"] or, on a bore, '
                'bearing = ["0 N", "0 N", "-5 kN"]'
            )
        return self

    def _values(self) -> Iterator[float]:
        yield from self.force or ()
        yield self.pressure or 0.0
        yield from self.moment or ()
        yield from self.bearing or ()


class LoadCaseSpec(Table):
    """Supports, loads, acceleration and temperature that act at the same time."""

    called: ClassVar[Mapping[str, str]] = {
        "support": "fix",
        "supports": "fix",
        "constraint": "fix",
        "constraints": "fix",
        "force": "load",
        "forces": "load",
        "gravity": "acceleration",
    }

    name: Name = Field(examples=["tip load"])
    """Shown in the report; unique."""
    fix: tuple[FixSpec, ...] = ()
    """Supports."""
    load: tuple[LoadSpec, ...] = ()
    """Loads on regions."""
    acceleration: Annotated[Triple, Vector("acceleration")] = Field(
        default=(0.0, 0.0, 0.0), examples=[["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]]
    )
    """Acceleration, mm/s^2; the body force is density times this, so gravity points down."""
    temperature_change: Annotated[float, Quantity("temperature")] = 0.0
    """Change of temperature, K, uniform, from the stress-free state."""

    @property
    def has_forces(self) -> bool:
        """Whether loads or an acceleration act, not only heat and moved supports."""
        return not all(load.is_zero for load in self.load) or any(self.acceleration)

    @model_validator(mode="after")
    def _held_and_loaded(self) -> LoadCaseSpec:
        if not self.fix:
            raise key_error(
                "fix",
                f"load case {shown(self.name)} has no support, so the part is free to move in "
                'all six ways; add fix = [{region = "root"}]',
            )
        moved = any(value for fix in self.fix for value in fix.displacement)
        if not (self.has_forces or moved or self.temperature_change):
            raise key_error(
                "load",
                f"load case {shown(self.name)} loads nothing: every force, pressure, moment, "
                "bearing load, acceleration, temperature change and prescribed displacement is "
                "zero; add "
                'load = [{region = "tip", force = ["0 N", "0 N", "-5 kN"]}]',
            )
        return self
