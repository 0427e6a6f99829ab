"""``[lattice.orientation]``: directions that the axes of the cells follow."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, ValidationInfo, field_validator, model_validator

from gradedesign.common.values.formula_text import FormulaText
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    FilePath,
    JsonSchema,
    Name,
    Number,
    Reader,
    Refused,
    three,
)
from gradedesign.geometry.part.part_schema import data_file

_SOURCES = ("load_case", "direction", "vtu")
_DIRECTION = ["cos(x / 30)", "sin(x / 30)", "0"]


class _Formulas(Reader):
    """Three formulas."""

    __slots__ = ()

    def read(self, value: object) -> tuple[str, str, str]:
        x, y, z = (FormulaText().read(v) for v in three(value, json.dumps(_DIRECTION)))
        return x, y, z

    def json_schema(self) -> JsonSchema:
        item = FormulaText().json_schema()
        return {
            "type": "array",
            "items": item,
            "minItems": 3,
            "maxItems": 3,
            "examples": [_DIRECTION],
        }


class OrientationSpec(Table):
    """Directions that cell axes follow: exactly one source."""

    example: ClassVar[str] = '{load_case = "tip load"}'

    load_case: Name | None = Field(default=None, examples=["tip load"])
    """Principal stresses of the fully solid part in this load case; in a run only."""
    direction: Annotated[tuple[str, str, str] | None, _Formulas()] = None
    """Components of a direction, formulas in x, y, z and the depth d, in mm; its length is how
    much it counts."""
    vtu: FilePath | None = Field(default=None, examples=["stress.vtu"])
    """Tetrahedra with a field of stresses, 6 (xx, yy, zz, xy, yz, xz) or 9 components, or of
    directions, 3 components."""
    field: Name | None = Field(default=None, examples=["stress"])
    """Name of the field of ``vtu``; without it there must be only one."""
    smooth: Annotated[float, Number(above=0.0, at_most=100.0)] = Field(default=1.0)
    """Length over which directions are smoothed, in cells."""

    @field_validator("vtu", mode="before")
    @classmethod
    def _find_file(cls, value: Any, info: ValidationInfo) -> Path:
        return data_file(value, info, "stress.vtu", (".vtu",))

    @model_validator(mode="after")
    def _one_source(self) -> OrientationSpec:
        source_keys = [key for key in _SOURCES if getattr(self, key) is not None]
        if len(source_keys) != 1:
            stated = " and ".join(source_keys) or "none"
            raise Refused(f"found {stated}; expected exactly one of {', '.join(_SOURCES)}")
        if self.field is not None and self.vtu is None:
            raise key_error("field", "belongs to vtu")
        return self
