"""``[limits]``: what the printed lattice must not exceed."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, TypeAlias, TypeVar

from pydantic import Field, model_validator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.common.values.value_types import (
    Choice,
    Flag,
    JsonSchema,
    Name,
    Number,
    Quantity,
    Reader,
    Refused,
    RegionName,
    check_range,
)
from gradedesign.geometry.part.regions_schema import AxisIndex
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.material.material import Material

_TIMES_SOLID = re.compile(
    r"\s*(\d{1,6}(?:\.\d{0,6})?|\.\d{1,6})\s*[x\u00d7*]\s*solid\s*", re.ASCII | re.IGNORECASE
)
_MESH_SIZES = re.compile(r"\s*(\d{1,4}(?:\.\d{0,6})?)\s+mesh[ _]sizes?\s*", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """Radius around supports that make stress singular, within which it is not judged.

    Without either it follows the cell and the support, see `resolve.exclusion`.
    """

    radius: float | None = None  #: mm.
    mesh_sizes: float | None = None  #: Multiples of the mesh size of the analysis.


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
        return {
            **Quantity("length").json_schema(),
            "examples": ["2 mesh sizes", "5 mm"],
            "x-range": "at least 0 mm, or at most 100 mesh sizes",
        }


_ExclusionField: TypeAlias = Annotated[Exclusion, _Exclusion()]


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidMultiple:
    """A multiple of the value of the fully solid part in the same load case.

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


@dataclass(frozen=True, slots=True)
class Allowed(Reader):
    """A quantity of one dimension above 0, or ``"2 x solid"``.

    For a field of a limit in the case file, ``Annotated[float | SolidMultiple, Allowed("work")]``.

    Attributes
    ----------
    dimension : str
        Of `units.DIMENSIONS`, such as ``"length"`` or ``"work"``.
    """

    dimension: str

    def read(self, value: object) -> float | SolidMultiple:
        """A number in the internal unit, or a multiple."""
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
            return Quantity(self.dimension, above=0.0).read(value)
        except Refused as error:
            raise Refused(
                f'{error}, or a multiple of what the solid part has, such as "2 x solid"'
            ) from None

    def json_schema(self) -> JsonSchema:
        """A string; the examples show both forms."""
        wanted = DIMENSIONS[self.dimension]
        text = f"{wanted.phrase} above 0, or a multiple of the solid part's value, at least 1"
        return {
            **Quantity(self.dimension).json_schema(),
            "description": text,
            "examples": [wanted.example, "1.5 x solid"],
            "x-range": f"above {wanted.words(0.0)}, or at least 1 x solid",
        }


@dataclass(frozen=True, slots=True)
class AtLeast(Allowed):
    """A least value of one dimension, above 0: ``Annotated[float, AtLeast("frequency")]``."""

    def read(self, value: object) -> float:
        """A number in the internal unit."""
        return Quantity(self.dimension, above=0.0).read(value)

    def json_schema(self) -> JsonSchema:
        """A string."""
        return Quantity(self.dimension, above=0.0).json_schema()


def in_number(allowed: float | SolidMultiple) -> float:
    """The allowed value as a number; NaN if it depends on the solid analysis.

    Examples
    --------
    >>> in_number(0.5), in_number(SolidMultiple(factor=2.0))
    (0.5, nan)
    """
    return math.nan if isinstance(allowed, SolidMultiple) else allowed


def as_multiple(allowed: float | SolidMultiple) -> float | None:
    """Multiple of the solid part's value; None where a quantity is stated.

    Examples
    --------
    >>> as_multiple(SolidMultiple(factor=2.0)), as_multiple(0.5)
    (2.0, None)
    """
    return allowed.factor if isinstance(allowed, SolidMultiple) else None


def stated_words(allowed: float | SolidMultiple, unit: str) -> str:
    """The allowed value as a person reads it: ``2 mm`` or ``2 x solid``.

    Examples
    --------
    >>> stated_words(0.5, "mm"), stated_words(SolidMultiple(factor=2.0), "mm")
    ('0.5 mm', '2 x solid')
    """
    return allowed.words if isinstance(allowed, SolidMultiple) else f"{allowed:g} {unit}"


class LimitEntry(Table):
    """One table of a list of limits in the case file, for one load case or all of them."""

    #: Fields that say what is allowed, beside those that `Allowed` reads; `words` tells them.
    allowing: ClassVar[tuple[str, ...]] = ()

    load_case: Name | None = Field(default=None, examples=["tip load"])
    """Name of the only load case it holds for; without it, all."""

    @property
    def words(self) -> str:
        """That which the fields of `allowing` allow, as a person reads it."""
        return ""

    def refusal(self, material: Material) -> tuple[str, str] | None:  # noqa: ARG002
        """Its key and words where it cannot be had of a material; None where it can."""
        return None

    def judged(self, load_cases: Sequence[LoadCaseSpec]) -> list[LoadCaseSpec]:
        """Load cases that it holds for."""
        return [load for load in load_cases if self.load_case in (None, load.name)]


class DisplacementLimit(LimitEntry):
    """Largest nodal displacement of a region: of the whole vector, or of one component of it.

    ``magnitude`` is always the allowed absolute value; ``component`` narrows it to one direction.
    """

    called: ClassVar[Mapping[str, str]] = {
        "max": "magnitude",
        "value": "magnitude",
        "limit": "magnitude",
        "allowed": "magnitude",
        "direction": "component",
        "axis": "component",
    }

    region: RegionName = Field(examples=["tip"])
    """Name of the region."""
    magnitude: Annotated[float | SolidMultiple, Allowed("length")] = Field(
        examples=["2 mm", "1.5 x solid"]
    )
    """Allowed absolute value: mm, or so many times that of the solid part, each load case its
    own."""
    component: AxisIndex | None = None
    """The one component that is limited, instead of the magnitude; 0, 1 or 2 once read."""


class LimitsSpec(Table):
    """A stress limit, a safety factor or lists of other limits.

    Kinds of limits that bring an entry of their own add a list under
    their name.
    """

    replaced: ClassVar[Mapping[str, str]] = {
        name: "is what a run makes as small as the other limits allow; leave it out"
        for name in ("mass", "weight", "volume", "volume_fraction")
    }
    called: ClassVar[Mapping[str, str]] = {
        "natural_frequency": "frequency",
        "eigenfrequency": "frequency",
        "linear_buckling": "part_buckling",
        "buckling_load_factor": "part_buckling",
        "load_factor": "part_buckling",
        "von_mises": "stress",
        "deflection": "displacement",
        "factor_of_safety": "safety_factor",
        "fos": "safety_factor",
    }

    stress: Annotated[float, Quantity("stress", above=0.0)] | None = None
    """Allowed von Mises stress, MPa."""
    safety_factor: Annotated[float, Number(at_least=1.0, at_most=1000.0)] | None = Field(
        default=None, examples=[2.0]
    )
    """Allowed stress is the yield strength over this."""
    beyond_yield: Annotated[bool, Flag()] = False
    """Whether ``stress`` may be above the yield strength, although the analysis is linear."""
    buckling: Annotated[str, Choice(("on", "off"))] = "on"
    """Whether buckling of the cells is judged beside a stress limit."""
    buckling_factor: Annotated[float, Number(at_least=1.0, at_most=1000.0)] | None = Field(
        default=None, examples=[2.0]
    )
    """Critical stress over the acting one, at least; by default the safety factor, or 1."""
    percentile: Annotated[float, Number(above=50.0, at_most=100.0)] = 99.5
    """Share of the volume, in per cent, that must stay below the stress limit."""
    exclusion: _ExclusionField = Field(default_factory=Exclusion, alias="exclusion_radius")
    """Radius around supports that make stress singular, in which it is not judged; without it a
    quarter of a cell, less around small supports and in small parts."""
    displacement: tuple[DisplacementLimit, ...] = ()
    """Displacement limits."""
    judged: Annotated[str, Choice(("nominal", "as_built", "both"))] | None = None
    """Body that must meet the limits where the case has [process]: the designed one (``nominal``),
    the one that the process builds of it (``as_built``), or ``both``, as by default."""

    @classmethod
    def lists(cls) -> tuple[str, ...]:
        """Names of the lists of limits, those that kinds bring included."""
        brought = [name for name in cls.model_fields if name not in LimitsSpec.model_fields]
        return ("displacement", *brought)

    @property
    def limits_stress(self) -> bool:
        """Whether a stress is limited, for one loading or for many."""
        return any((self.stress, self.safety_factor, getattr(self, "fatigue", None)))

    @property
    def empty(self) -> bool:
        """Whether there is no limit."""
        lists = [getattr(self, name) for name in self.lists()]
        return self.stress is None and self.safety_factor is None and not any(lists)

    @property
    def exclusion_radius(self) -> float | None:
        """Radius in mm, or None when none is stated as a length."""
        return self.exclusion.radius

    @property
    def exclusion_mesh_sizes(self) -> float | None:
        """Radius in multiples of the mesh size, or None when none is stated so."""
        return self.exclusion.mesh_sizes

    @model_validator(mode="after")
    def _stress_limit(self) -> LimitsSpec:
        if self.stress is not None and self.safety_factor is not None:
            raise key_error(
                "safety_factor", "found beside stress; expected one of them, they may disagree"
            )
        if self.beyond_yield and self.stress is None:
            raise key_error("beyond_yield", "has no meaning without stress; leave it out")
        if self.buckling == "off" and self.buckling_factor is not None:
            raise key_error(
                "buckling_factor", 'found beside buckling = "off"; leave one of them out'
            )
        return self


Layout = TypeVar("Layout", bound=Table)
