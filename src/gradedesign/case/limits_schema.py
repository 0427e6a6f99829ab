"""``[limits]``: what the printed lattice must not exceed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, TypeAlias

from pydantic import Field, model_validator

from gradedesign.case.regions_schema import AxisIndex
from gradedesign.case.suggest import shown
from gradedesign.case.table import Table, key_error
from gradedesign.case.value_types import (
    Choice,
    JsonSchema,
    Name,
    Number,
    Quantity,
    Reader,
    Refused,
    RegionName,
    check_range,
)

_TIMES_SOLID = re.compile(
    r"\s*(\d{1,6}(?:\.\d{0,6})?|\.\d{1,6})\s*[x\u00d7*]\s*solid\s*", re.ASCII | re.IGNORECASE
)
_MESH_SIZES = re.compile(r"\s*(\d{1,4}(?:\.\d{0,6})?)\s+mesh[ _]sizes?\s*", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """Radius around held regions, whole faces and not their edges only, where stress is not judged.

    Attributes
    ----------
    radius : float or None, mm
    mesh_sizes : float or None
        Multiples of the mesh size of the analysis; exactly one of the two is set.
    """

    radius: float | None = None
    mesh_sizes: float | None = None


class _Exclusion(Reader):
    """``"2 mesh sizes"`` or a length."""

    __slots__ = ()

    def read(self, value: object) -> Exclusion:
        match = _MESH_SIZES.fullmatch(value) if isinstance(value, str) and len(value) < 60 else None
        if match is not None:
            sizes = float(match[1])
            check_range(sizes, shown(value), at_most=100.0)
            return Exclusion(mesh_sizes=sizes)
        try:
            return Exclusion(radius=Quantity("length", at_least=0.0).read(value))
        except Refused as error:
            raise Refused(f'{error}, or a multiple such as "2 mesh sizes"') from None

    def json_schema(self) -> JsonSchema:
        return {"type": "string", "examples": ["2 mesh sizes", "5 mm"]}


_ExclusionField: TypeAlias = Annotated[Exclusion, _Exclusion()]


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidMultiple:
    """So many times the value that the fully solid part has in the same load case.

    Attributes
    ----------
    factor : float
        At least 1.
    """

    factor: float

    @property
    def words(self) -> str:
        """As it is written: ``2 x solid``."""
        return f"{self.factor:g} x solid"


class _Magnitude(Reader):
    """A length, or ``"2 x solid"``."""

    __slots__ = ()

    def read(self, value: object) -> float | SolidMultiple:
        short = isinstance(value, str) and len(value) < 60
        match = _TIMES_SOLID.fullmatch(value) if isinstance(value, str) and short else None
        if match is not None:
            factor = float(match[1])
            if factor < 1.0:
                raise Refused(
                    f"found {shown(value)}, which the solid part itself breaks; expected a "
                    f'multiple of at least 1, such as "2 x solid"'
                )
            check_range(factor, shown(value), at_most=1e6)
            return SolidMultiple(factor=factor)
        try:
            return Quantity("length", above=0.0).read(value)
        except Refused as error:
            raise Refused(
                f'{error}, or a multiple of what the solid part has, such as "2 x solid"'
            ) from None

    def json_schema(self) -> JsonSchema:
        text = "a length above 0, or a multiple of the solid part's value, at least 1"
        return {"type": "string", "description": text, "examples": ["2 mm", "1.5 x solid"]}


class DisplacementLimit(Table):
    """Largest nodal displacement of a region: of the whole vector, or of one component of it.

    ``magnitude`` is always the allowed absolute value; ``component`` narrows it to one direction.
    """

    region: RegionName = Field(examples=["tip"])
    """Name of the region."""
    magnitude: Annotated[float | SolidMultiple, _Magnitude()] = Field(
        examples=["2 mm", "1.5 x solid"]
    )
    """Allowed absolute value: mm, or so many times that of the solid part, each load case its
    own."""
    component: AxisIndex | None = None
    """0, 1 or 2 when only x, y or z is limited."""
    load_case: Name | None = None
    """Name of the only load case it holds for; None for all."""

    @property
    def value(self) -> float | None:
        """The allowed absolute value, mm; None where only the solid analysis can tell."""
        return None if isinstance(self.magnitude, SolidMultiple) else self.magnitude

    @property
    def times_solid(self) -> float | None:
        """Multiple of the solid part's value; None where a length is stated."""
        return self.magnitude.factor if isinstance(self.magnitude, SolidMultiple) else None

    @property
    def words(self) -> str:
        """The allowed value as a person reads it: ``2 mm`` or ``2 x solid``."""
        if isinstance(self.magnitude, SolidMultiple):
            return self.magnitude.words
        return f"{self.magnitude:g} mm"


class LimitsSpec(Table):
    """A stress limit, a safety factor or displacement limits; at least one of them."""

    stress: Annotated[float, Quantity("stress", above=0.0)] | None = None
    """Allowed von Mises stress, MPa."""
    safety_factor: Annotated[float, Number(at_least=1.0, at_most=1000.0)] | None = None
    """Allowed stress is the yield strength over this."""
    buckling: Annotated[str, Choice(("on", "off"))] = "on"
    """Whether buckling of the cells is judged beside a stress limit."""
    buckling_factor: Annotated[float, Number(at_least=1.0, at_most=1000.0)] | None = None
    """Critical stress over the acting one, at least; by default the safety factor, or 1."""
    percentile: Annotated[float, Number(above=50.0, at_most=100.0)] = 99.5
    """Share of the volume, in per cent, that must stay below the stress limit."""
    exclusion: _ExclusionField = Field(default=Exclusion(mesh_sizes=2.0), alias="exclusion_radius")
    """Radius around the regions that supports hold, in which stress is not judged."""
    displacement: tuple[DisplacementLimit, ...] = ()
    """Displacement limits."""

    @property
    def exclusion_radius(self) -> float | None:
        """Radius in mm, or None when it is stated in mesh sizes."""
        return self.exclusion.radius

    @property
    def exclusion_mesh_sizes(self) -> float | None:
        """Radius in multiples of the mesh size, or None when it is stated as a length."""
        return self.exclusion.mesh_sizes

    @model_validator(mode="after")
    def _any_limit(self) -> LimitsSpec:
        if self.stress is not None and self.safety_factor is not None:
            raise key_error(
                "safety_factor", "found beside stress; expected one of them, they may disagree"
            )
        if self.buckling == "off" and self.buckling_factor is not None:
            raise key_error(
                "buckling_factor", 'found beside buckling = "off"; leave one of them out'
            )
        if self.stress is None and self.safety_factor is None and not self.displacement:
            raise Refused(
                'no limit given; add stress = "50 MPa", safety_factor = 2 or '
                'displacement = [{region = "tip", magnitude = "2 mm"}]'
            )
        return self
