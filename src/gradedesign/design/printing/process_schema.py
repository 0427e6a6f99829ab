"""``[process]``: a process by name, by a record, or what was measured of one."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, model_validator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    FilePath,
    Flag,
    JsonSchema,
    Name,
    Number,
    Quantity,
    Reader,
    Refused,
    Size,
    Text,
    Whole,
)
from gradedesign.design.printing.process import ByInclination, Process, Waviness
from gradedesign.mechanics.material.record_file import with_record

#: Most pairs of a table, and the largest growth or shrinkage of any process, mm. Chosen, not
#: measured.
_MOST_PAIRS, _MOST_OFFSET = 100, 10.0
_GROWTH = Quantity("length", at_least=-_MOST_OFFSET, at_most=_MOST_OFFSET)
#: Long enough for what was read, how it was taken, and what was not.
_LONGEST_SOURCE = 1000


@dataclass(frozen=True, slots=True)
class _Pairs(Reader):
    """Pairs of an inclination up to ``most`` degrees and a length, by rising inclination."""

    most: float
    example: str

    def read(self, value: object) -> ByInclination:
        inclination = Quantity("angle", at_least=0.0, at_most=self.most)
        if not isinstance(value, list) or not 0 < len(value) <= _MOST_PAIRS:
            raise Refused(f"found {shown(value)}; expected pairs such as {self.example}")
        pairs = []
        for n, pair in enumerate(value, start=1):
            if not isinstance(pair, list) or len(pair) != 2:
                raise Refused(
                    f"entry {n}: found {shown(pair)}; expected a pair as in {self.example}"
                )
            try:
                pairs.append((inclination.read(pair[0]), _GROWTH.read(pair[1])))
            except Refused as error:
                raise Refused(f"entry {n}: {error}") from None
            if n > 1 and not pairs[-1][0] > pairs[-2][0]:
                raise Refused(f"entry {n}: found {shown(pair[0])}; expected rising angles")
        return tuple(pairs)

    def json_schema(self) -> JsonSchema:
        inclination = Quantity("angle", at_least=0.0, at_most=self.most)
        kinds = [inclination.json_schema(), _GROWTH.json_schema()]
        pair = {"type": "array", "items": kinds, "minItems": 2, "maxItems": 2}
        pairs = {"type": "array", "items": pair, "minItems": 1, "maxItems": _MOST_PAIRS}
        return {**pairs, "examples": [json.loads(self.example)]}


class _Sizes(Reader):
    """The least and the largest size."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        size, example = Quantity("length", above=0.0), 'a pair such as ["0.2 mm", "1.3 mm"]'
        if not isinstance(value, list) or len(value) != 2:
            raise Refused(f"found {shown(value)}; expected {example}")
        least, most = (size.read(entry) for entry in value)
        if least > most:
            raise Refused(f"found {shown(value)}; expected the smaller one first")
        return least, most

    def json_schema(self) -> JsonSchema:
        length = Quantity("length", above=0.0).json_schema()
        return {
            "type": "array", "items": length, "minItems": 2, "maxItems": 2,
            "examples": [["0.2 mm", "1.3 mm"]],
        }  # fmt: skip


class WavinessSpec(Table):
    """Random deviation of the surface from place to place."""

    example: ClassVar[str] = '{amplitude = "0.02 mm", length = "0.3 mm"}'

    amplitude: Size = Field(examples=["0.02 mm"])
    """Root mean square, mm."""
    length: Size = Field(examples=["0.3 mm"])
    """Distance over which it is alike, mm: the correlation falls as exp(-(r / length)^2 / 2)."""


class MeasuredProcess(Table):
    """Measurements of a process: a table of struts or one of surfaces, and what else is known."""

    strut_size: (
        Annotated[
            ByInclination,
            _Pairs(90.0, '[["0 deg", "0.1 mm"], ["45 deg", "0.05 mm"], ["90 deg", "0.01 mm"]]'),
        ]
        | None
    ) = None
    """Change of the width of struts, mm, by the inclination of their axis to the plate: 0 deg lies,
    90 deg stands; linear in the cosine between the pairs, constant beyond them."""
    offset: (
        Annotated[
            ByInclination,
            _Pairs(180.0, '[["0 deg", "0.2 mm"], ["45 deg", "0.05 mm"], ["90 deg", "0 mm"]]'),
        ]
        | None
    ) = None
    """Growth of the surface, mm, by its inclination, in place of ``strut_size``: 0 deg looks down
    at the plate, 90 deg is a wall, 180 deg looks up; linear between the pairs, constant beyond
    them."""
    scatter: Size | None = Field(default=None, examples=["0.04 mm"])
    """Standard deviation of the width from strut to strut, mm; ``variants`` show what it does."""
    waviness: WavinessSpec | None = None
    """Random deviation of the surface from place to place."""
    least_feature: Size | None = Field(default=None, examples=["0.2 mm"])
    """Thinnest wall or strut that the process prints, mm."""
    stiffness: Annotated[float, Number(above=0.0, at_most=1.5)] | None = Field(
        default=None, examples=[0.9]
    )
    """Young's modulus of the printed solid over that of [material]; across the build direction
    where ``stiffness_along`` states another one along it."""
    stiffness_along: Annotated[float, Number(above=0.0, at_most=1.5)] | None = Field(
        default=None, examples=[0.85]
    )
    """Young's modulus along the build direction over that of [material]."""
    shear_along: Annotated[float, Number(above=0.0, at_most=1.5)] | None = Field(
        default=None, examples=[0.9]
    )
    """Shear modulus in planes along the build direction over that in planes across it; without it
    it follows from both Young's moduli."""
    material: Name | None = Field(default=None, examples=["Ti-6Al-4V"])
    """Material that was measured, as [material] names it."""
    machine: Name | None = Field(default=None, examples=["EOS M 290"])
    """Machine that was measured."""
    samples: Annotated[int, Whole(1, 10**6)] | None = Field(default=None, examples=[10])
    """Struts or specimens that were measured for every entry."""
    sizes: Annotated[tuple[float, float], _Sizes()] | None = None
    """Least and largest width that was measured, mm; a warning tells where a design leaves it."""
    source: Annotated[str, Text("a source", _LONGEST_SOURCE)] | None = Field(
        default=None, examples=["coupons of 2026-03"]
    )
    """Where the figures come from."""

    @model_validator(mode="after")
    def _one_table(self) -> MeasuredProcess:
        if self.strut_size is not None and self.offset is not None:
            raise key_error("offset", "found beside strut_size; expected one of them")
        for key, needed in (("stiffness_along", "stiffness"), ("shear_along", "stiffness_along")):
            if getattr(self, key) is not None and getattr(self, needed) is None:
                raise key_error(key, f"goes with {needed}, such as {needed} = 0.9")
        return self

    def record(self, name: str) -> Process:
        """The process of a name with what was measured."""
        stated = {
            key: value
            for key in MeasuredProcess.model_fields
            if (value := getattr(self, key)) is not None and key != "waviness"
        }
        wave = self.waviness
        waviness = None if wave is None else Waviness(amplitude=wave.amplitude, length=wave.length)
        return Process(name=name, waviness=waviness, **stated)


class ProcessSpec(MeasuredProcess):
    """A process by ``name`` or ``file``, or what was measured of one, and what is asked of it."""

    example: ClassVar[str] = '{name = "lpbf-ti64-struts"}'

    called: ClassVar[Mapping[str, str]] = {
        "process": "name",
        "as_built_offset": "offset",
        "spread": "scatter",
        "roughness": "waviness",
        "min_feature": "least_feature",
        "compensation": "compensate",
    }

    name: Name | None = Field(default=None, examples=["lpbf-ti64-struts"])
    """Name in the library: ``gradedesign processes`` lists them."""
    file: FilePath | None = Field(default=None, examples=["m290-ti64.toml"])
    """Record of what was measured, such as ``gradedesign coupon`` writes: its table ``[process]``
    states the keys."""
    compensate: Annotated[bool, Flag()] = False
    """Whether a second file is written whose surface is offset beforehand, so that the body that is
    built of it is the designed one; the as-built body is then that of this file."""
    variants: Annotated[int, Whole(0, 1000)] = 0
    """Random as-built bodies that are analysed once a design is accepted, for the mean and the
    percentiles of every limit; each takes one analysis."""
    seed: Annotated[int, Whole(0, 2**31 - 1)] = 2027
    """Of waviness and scatter: the same seed is the same body."""

    @model_validator(mode="before")
    @classmethod
    def _recorded(cls, value: Any, info: ValidationInfo) -> Any:
        if isinstance(value, dict) and "file" in value and "name" in value:
            raise key_error("file", "found beside name; expected one of them")
        return with_record(value, info, "process", MeasuredProcess)

    @model_validator(mode="after")
    def _named_or_stated(self) -> ProcessSpec:
        measured = [key for key in MeasuredProcess.model_fields if key in self.model_fields_set]
        if self.name is not None and measured:
            raise key_error(
                measured[0],
                "found beside name; expected either a name from the library or what was measured "
                "without a name",
            )
        known = ("file", "strut_size", "offset", "waviness", "stiffness")
        if self.name is None and all(getattr(self, key) is None for key in known):
            raise ValueError(
                "found neither name nor what makes a body another one; expected a name from the "
                'library such as name = "lpbf-ti64-struts", or strut_size, offset, waviness or '
                "stiffness as measured"
            )
        return self


def builtin_processes() -> Iterator[Process]:
    """Published processes of ``processes.toml``, whose keys are those of ``[process]``."""
    text = resources.files(__package__).joinpath("processes.toml").read_text("utf-8")
    for name, table in tomllib.loads(text).items():
        yield MeasuredProcess.model_validate(table).record(name)
