"""The text of a formula as a value of a case file."""

from __future__ import annotations

from gradedesign.common.values.formula import parse_formula
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.value_types import JsonSchema, Reader, Refused
from gradedesign.errors import CaseError


class FormulaText(Reader):
    """The text of a formula, checked when the case is read."""

    __slots__ = ()

    def read(self, value: object) -> str:
        """Accept a text that parses."""
        if not isinstance(value, str):
            raise Refused(
                f'found {shown(value)}; expected a formula such as "0.1 + 0.4 * x / 100", with x, '
                f"y, z and the depth d below the surface in mm"
            )
        try:
            return parse_formula(value).text
        except CaseError as error:
            raise Refused(str(error)) from None

    def json_schema(self) -> JsonSchema:
        """A string."""
        example = "0.1 + 0.4 * x / 100"
        return {"type": "string", "examples": [example], "x-range": "a formula in x, y, z and d"}
