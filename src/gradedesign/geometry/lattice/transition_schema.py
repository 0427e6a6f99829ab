"""``[lattice.transition]``: a second family, into which the first passes over."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gradedesign.common.values.formula_text import FormulaText
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import (
    Choice,
    JsonSchema,
    Name,
    Number,
    Parameters,
    Reader,
    Triple,
    three,
)


class _Shift(Reader):
    """``"auto"`` or three numbers."""

    __slots__ = ()

    def read(self, value: object) -> Triple | None:
        if value == "auto":
            return None
        x, y, z = (Number().read(v) for v in three(value, "[0.5, 0.5, 0]"))
        return x, y, z

    def json_schema(self) -> JsonSchema:
        number = Number().json_schema()
        return {
            "anyOf": [
                {"const": "auto"},
                {"type": "array", "items": number, "minItems": 3, "maxItems": 3},
            ],
            "examples": [[0.5, 0.5, 0.0]],
        }


class TransitionSpec(Table):
    """A second family, into which the first passes over."""

    cell: Name = Field(examples=["bcc"])
    """Name of a cell family."""
    parameters: Annotated[dict[str, float], Parameters()] = Field(default_factory=dict)
    """Its parameters by name."""
    weight: Annotated[str, FormulaText()] = Field(examples=["smoothstep(20, 40, x)"])
    """Share of the second family, 0 to 1, a formula in x, y, z and the depth d, in mm."""
    scale: Annotated[str, Choice(("rank", "distance"))] = "rank"
    """On which the two mix: the density at which a point becomes solid, or its distance from the
    surface."""
    shift: Annotated[Triple | None, _Shift()] = None
    """By which the second family is moved, in cells; auto: not, unless only that joins them."""
