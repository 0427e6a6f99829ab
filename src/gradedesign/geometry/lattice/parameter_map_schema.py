"""``[lattice.parameter_map]``: a parameter of the cell that changes from place to place."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gradedesign.common.values.formula_text import FormulaText
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import JsonSchema, Name, Number, Reader, Refused, Whole


class _Ends(Reader):
    """Two different numbers."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        if not isinstance(value, list) or len(value) != 2:
            raise Refused(f"found {shown(value)}; expected two numbers such as [0.0, 0.1]")
        first, last = (Number().read(v) for v in value)
        if first == last:
            raise Refused(f"found {first:g} twice; expected two different numbers")
        return first, last

    def json_schema(self) -> JsonSchema:
        return {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}


class ParameterMapSpec(Table):
    """A free parameter of the family, between two values."""

    parameter: Name = Field(examples=["amplitude"])
    """Its name."""
    values: Annotated[tuple[float, float], _Ends()] = Field(examples=[[0.1, 0.0]])
    """At the lowest and at the highest density; with a formula, between which it must stay."""
    formula: Annotated[str | None, FormulaText()] = None
    """Value in x, y, z and the depth d, in mm; without it the parameter follows the density."""
    increments: Annotated[int, Whole(2, 65)] = 9
    """Values at which the cell is calibrated; between them neighbours are mixed."""
