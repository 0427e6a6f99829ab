"""``[material]``: a name from the library, a record, or the properties themselves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, model_validator

from gradedesign.common.values.suggest import listed, shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    FilePath,
    JsonSchema,
    Name,
    Number,
    Quantity,
    Reader,
    Refused,
    Text,
)
from gradedesign.errors import CaseError
from gradedesign.mechanics.material.fatigue_curve import FatigueCurve
from gradedesign.mechanics.material.record_file import recorded, with_record

_NEEDED = ("youngs_modulus", "poissons_ratio", "density")
#: Keys that go with a name.
_BESIDE = {"name", "fatigue"}
#: Keys of a record beside the properties: what they are of, and from where.
_TEXTS = ("name", "source")


@dataclass(frozen=True, slots=True)
class _Several(Reader):
    """A list of two values or more of one kind, kept as a tuple."""

    entry: Number | Quantity
    example: str

    def read(self, value: object) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) < 2:
            raise Refused(f"found {shown(value)}; expected a list such as {self.example}")
        return tuple(self.entry.read(each) for each in value)

    def json_schema(self) -> JsonSchema:
        item, examples = self.entry.json_schema(), [json.loads(self.example)]
        return {"type": "array", "items": item, "minItems": 2, "examples": examples}


class FatigueCurveSpec(Table):
    """An S-N curve of the solid material: stress amplitude over cycles to failure."""

    called: ClassVar[Mapping[str, str]] = {
        "r": "ratio",
        "stress_ratio": "ratio",
        "load_ratio": "ratio",
        "n": "cycles",
        "stress_amplitude": "amplitude",
        "surface_condition": "surface",
        "gamma": "walker",
    }

    surface: Name = Field(examples=["as-built"])
    """Condition of the specimens' surface, under the name that ``[limits] fatigue`` gives it."""
    ratio: Annotated[float, Number(at_least=-1.0, below=1.0)] = Field(examples=[-1.0])
    """R of the tests: least over largest stress of a cycle; -1 is fully reversed."""
    cycles: Annotated[tuple[float, ...], _Several(Number(at_least=1.0, at_most=1e12), "[1e4, 1e6]")]
    """Cycles to failure, rising; between them straight lines on logarithmic axes."""
    amplitude: Annotated[
        tuple[float, ...], _Several(Quantity("stress", above=0.0), '["400 MPa", "200 MPa"]')
    ]
    """Half of largest less least stress that is borne so often, MPa."""
    walker: Annotated[float, Number(at_least=0.0, at_most=1.0)] = 0.5
    """Walker's exponent, by which the curve is read at another ratio; 0.5 is the rule of Smith,
    Watson and Topper."""
    source: Annotated[str, Text("a source", 400)] = Field(
        default="stated in the case", examples=["12 axial specimens of 2026-03, vertical"]
    )
    """Where the figures come from."""

    def curve(self) -> FatigueCurve:
        """The curve that it states."""
        return FatigueCurve(**dict(self))

    @model_validator(mode="after")
    def _sound(self) -> FatigueCurveSpec:
        self.curve()
        return self


class MaterialSpec(Table):
    """Either ``name`` or ``file`` alone, from the library or a record, or its own properties."""

    example: ClassVar[str] = '{name = "Ti-6Al-4V"}'

    called: ClassVar[Mapping[str, str]] = {
        "material": "name",
        "e": "youngs_modulus",
        "elastic_modulus": "youngs_modulus",
        "nu": "poissons_ratio",
        "rho": "density",
        "alpha": "thermal_expansion",
        "cte": "thermal_expansion",
    }

    name: Name | None = Field(default=None, examples=["Ti-6Al-4V"])
    """Name in the library."""
    file: FilePath | None = Field(default=None, examples=["m290-ti64.toml"])
    """Record of what was measured, whose table ``[material]`` states the properties."""
    youngs_modulus: Annotated[float, Quantity("stress", above=0.0)] | None = Field(
        default=None, examples=["114 GPa"]
    )
    """Young's modulus of the solid material, MPa."""
    poissons_ratio: Annotated[float, Number(above=-1.0, below=0.5)] | None = Field(
        default=None, examples=[0.34]
    )
    """Poisson's ratio."""
    density: Annotated[float, Quantity("density", above=0.0)] | None = None
    """Mass density of the solid material, t/mm^3."""
    yield_strength: Annotated[float, Quantity("stress", above=0.0)] | None = Field(
        default=None, examples=["880 MPa"]
    )
    """Stress at which the solid material yields, MPa; needed for a safety factor."""
    thermal_expansion: Annotated[float, Quantity("thermal_expansion")] | None = None
    """Coefficient of thermal expansion, 1/K; needed for a temperature change."""
    fatigue: tuple[FatigueCurveSpec, ...] = ()
    """S-N curves, one for each surface condition, beside the properties or in place of those that
    the library has of ``name``; needed for ``[limits] fatigue``."""

    @model_validator(mode="before")
    @classmethod
    def _recorded(cls, value: Any, info: ValidationInfo) -> Any:
        return with_record(value, info, "material", cls, texts=_TEXTS)

    def texts(self) -> tuple[str, str]:
        """Name and source of a stated material.

        Raises `CaseError` if the record that it is from is gone.
        """
        if self.file is None:
            return "stated in the case", "stated in the case"
        try:
            found = recorded(self.file, "material")
        except ValueError as error:
            raise CaseError(str(error)) from None
        name, source = (str(found.get(key, self.file.stem)) for key in _TEXTS)
        return name, source

    @model_validator(mode="after")
    def _complete(self) -> MaterialSpec:
        surfaces = [curve.surface for curve in self.fatigue]
        if len(set(surfaces)) < len(surfaces):
            raise key_error("fatigue", f"found surfaces {listed(surfaces)}; expected each once")
        if self.name is not None:
            extra = [k for k in type(self).model_fields if k in self.model_fields_set - _BESIDE]
            if extra:
                raise key_error(
                    extra[0],
                    "found beside name; expected either a name from the library or the "
                    "properties without a name",
                )
            return self
        missing = [k for k in _NEEDED if getattr(self, k) is None]
        if missing:
            raise ValueError(
                f"found no name and no {listed(missing)}; expected a name from the library such "
                f'as name = "Ti-6Al-4V", or all of {listed(_NEEDED)}'
            )
        return self
