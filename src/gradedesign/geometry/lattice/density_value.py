"""Values of ``[lattice] density``: a range to be searched, one number, or a formula."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.values.formula import Formula, evaluate_formula, parse_formula
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.value_types import JsonSchema, Number, Reader, Refused
from gradedesign.errors import CaseError


class DensityRange(Reader):
    """``[lowest, highest]`` relative density."""

    __slots__ = ()

    def read(self, value: object) -> tuple[float, float]:
        """Convert ``[0.10, 0.65]``."""
        if not isinstance(value, list) or len(value) != 2:
            digits = value if isinstance(value, list) and len(value) == 4 else ()
            example = "such as [0.10, 0.65]"
            if digits and all(isinstance(d, int) and d >= 0 for d in digits):
                a, b, c, d = digits
                example += f"; with decimal points: [{a}.{b}, {c}.{d}]"
            raise Refused(
                f"found {shown(value)}; expected the lowest and the highest relative density "
                f"{example}"
            )
        low, high = (Number(above=0.0, below=1.0).read(v) for v in value)
        if low > high:
            raise Refused(
                f"found [{low:g}, {high:g}], the lowest above the highest; expected "
                f"[{high:g}, {low:g}]"
            )
        return low, high

    def json_schema(self) -> JsonSchema:
        """Two numbers."""
        item = Number(above=0.0, below=1.0).json_schema()
        pair = {"type": "array", "items": item, "minItems": 2, "maxItems": 2}
        return {**pair, "examples": [[0.10, 0.65]]}


class Density(Reader):
    """A range, or one number; the schema also tells of a formula, which is taken as a map."""

    __slots__ = ()

    def read(self, value: object) -> float | tuple[float, float]:
        """Convert ``[0.10, 0.65]`` or ``0.3``; a text that comes here is no formula."""
        if not isinstance(value, int | float | str):
            return DensityRange().read(value)
        if isinstance(value, str) and not _is_number(value):
            try:
                parse_formula(value)
            except CaseError as error:
                raise Refused(
                    f"{error}; expected a density such as 0.3, a range such as [0.1, 0.6], or a "
                    f'formula such as "0.1 + 0.4 * x / 100"; files stand in [lattice.density_map]'
                ) from None
        return Number(above=0.0, below=1.0).read(value)

    def json_schema(self) -> JsonSchema:
        """A number, two, or a text."""
        number = Number(above=0.0, below=1.0).json_schema()
        return {
            "anyOf": [number, DensityRange().json_schema(), {"type": "string"}],
            "examples": [[0.10, 0.65], 0.3, "0.1 + 0.4 * x / 100"],
        }


def is_formula(value: object) -> bool:
    """Whether a value is the text of a formula rather than a number in quotes."""
    if not isinstance(value, str) or _is_number(value):
        return False
    try:
        parse_formula(value)
    except CaseError:
        return False
    return True


def states_density(lattice: object) -> bool:
    """Whether a table ``[lattice]`` as TOML gives it states its density, right or wrong."""
    if not isinstance(lattice, dict):
        return False
    return "density_map" in lattice or not isinstance(lattice.get("density", []), list)


def _is_number(text: str) -> bool:
    """Whether a text is a number, perhaps in per cent."""
    try:
        float(text.strip().removesuffix("%"))
    except ValueError:
        return False
    return True


def formula_field(formula: Formula, distance: Field) -> Field:
    """Value of a formula at points.

    Returns callable: points ``(3, ...)`` mm to values ``(...)``.

    ``formula``: in x, y, z and d, mm. ``distance``: signed distance of the part; d is the depth
    below its surface, 0 outside. Evaluated only if the formula contains d.

    Examples
    --------
    >>> from gradedesign.common.values.formula import parse_formula
    >>> ball = lambda p: np.linalg.norm(p, axis=0) - 10.0
    >>> density = formula_field(parse_formula("0.5 - 0.03 * d"), ball)
    >>> density(np.array([[0.0], [0.0], [0.0]])).round(12)
    array([0.2])
    """

    def value(points: FloatArray) -> FloatArray:
        points = np.asarray(points, dtype=np.float64)
        values = dict(zip("xyz", points, strict=True))
        if "d" in formula.variables:
            values["d"] = np.maximum(-distance(points), 0.0)
        return evaluate_formula(formula, values)

    return value
