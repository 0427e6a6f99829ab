"""Quantities with units: ``"5 kN"`` to 5000 N, by a regular expression and a fixed table.

No expression is evaluated: ``"9**9**9"`` is refused by its form, at once.
"""

from __future__ import annotations

import math
import re

from gradedesign.common.values.suggest import listed, nearest, shown
from gradedesign.common.values.units import DIMENSIONS, SPOKEN_UNITS, Dimension
from gradedesign.errors import CaseError

#: Characters of a quantity, far more than number and unit take: longer texts are not searched.
#: Chosen, not measured.
_LONGEST = 80
#: Signs and blanks that word processors put in place of those of the keyboard.
_TYPED = str.maketrans(
    {
        **dict.fromkeys("\u2212\u2013\u2014\u2010\u2011", "-"),
        **dict.fromkeys("\u00a0\u2009\u202f", " "),
    }
)
_QUANTITY = re.compile(
    r"(?P<number>[+-]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][+-]?\d{1,3})?)"
    # a unit starts with a letter; only a blank separates "1/K" from the number before it
    r"(?P<unit>(?: *[A-Za-zµμ°%][^\n]*| +1/[^\n]*)?)",
    re.ASCII,
)
#: Angles, degrees, that are recognised when stated in radians. Of numbers with two decimals only
#: 1.57, 2.62 and 3.14 are taken for one. Chosen, not measured.
_USUAL_ANGLES = (30.0, 45.0, 60.0, 90.0, 120.0, 135.0, 150.0, 180.0)
_REPLACED = (
    ("²", "^2"),
    ("³", "^3"),
    ("µ", "u"),
    ("μ", "u"),
    ("·", "*"),
    ("⋅", "*"),
    ("°C", "degC"),
    ("°", "deg"),
    ("**", "^"),
)


def parse_quantity(text: object, dimension: str) -> float:
    """Convert a quantity with its unit to the internal unit of its dimension.

    Raises `CaseError` naming what was found, the expected dimension and an example. Returns float:
    finite; zero only when a zero was written.

    - ``text``: value in the case file; only a string such as ``"5 kN"`` is accepted
    - ``dimension``: a key of :data:`gradedesign.common.values.units.DIMENSIONS`: length (mm), area
      (mm^2), volume (mm^3), force (N), pressure or stress (MPa), density (t/mm^3), acceleration
      (mm/s^2), temperature (K), thermal_expansion (1/K), time (s), memory (bytes), angle (degrees),
      moment (N mm), number

    Examples
    --------
    >>> parse_quantity("5 kN", "force")
    5000.0
    >>> parse_quantity("-9.81 m/s^2", "acceleration")
    -9810.0
    """
    wanted = DIMENSIONS[dimension]
    if not isinstance(text, str):
        raise CaseError(_not_text(text, wanted))
    # the length is checked first, so that no later step sees a long text
    match = _QUANTITY.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    if match is None:
        typed = _as_typed(text) if len(text) <= _LONGEST else ()
        if typed and all(t != text and _QUANTITY.fullmatch(t) for t in typed):
            written = " or ".join(shown(t) for t in typed)
            raise CaseError(
                f"found {shown(text)}, whose sign, blank or comma is none of a number; write "
                f"{written}"
            )
        raise CaseError(
            f"found {shown(text)}, which is not a number followed by a unit; "
            f"expected {wanted.phrase} such as {shown(wanted.example)}"
        )
    unit = normal_unit(match["unit"])
    if unit not in wanted.units:
        raise CaseError(_wrong_unit(text, match["unit"].strip(), wanted))
    number = float(match["number"])
    value = number * wanted.units[unit]
    if not math.isfinite(value):
        raise CaseError(f"found {shown(text)}, which is beyond any {_kind(wanted)}")
    if value == 0.0 and re.search(r"[1-9]", re.split(r"[eE]", match["number"])[0]):
        raise CaseError(f"found {shown(text)}, which is too small to tell from zero")
    if unit == "deg" and (meant := _meant_degrees(number)):
        raise CaseError(
            f"found {shown(text)}, which is {meant:g} deg in radians; expected an angle in "
            f'degrees such as "{meant:g} deg", or in radians such as "{match["number"]} rad"; as '
            f'so small an angle, write it in radians: "{math.radians(number):.6g} rad"'
        )
    return value


def _as_typed(text: str) -> tuple[str, ...]:
    """Possible readings of a quantity typed with other signs, blanks or commas.

    One comma before three digits may mark thousands or decimals: both readings are returned.

    Examples
    --------
    >>> _as_typed("-0,5 kN"), _as_typed("1.000,5 MPa"), _as_typed("1,000 MPa")
    (('-0.5 kN',), ('1000.5 MPa',), ('1000 MPa', '1.000 MPa'))
    """
    plain = text.translate(_TYPED).strip()
    number = re.match(r"[+-]?\d[\d., ']*(?<=\d)", plain)
    if number is None:
        return (plain,)
    digits, unit = number.group(), plain[number.end() :]
    if re.fullmatch(r"[+-]?\d{1,3}(?:[ ']\d{3})+(?:[.,]\d+)?", digits):
        return (re.sub("[ ']", "", digits).replace(",", ".") + unit,)
    if re.fullmatch(r"[+-]?\d{1,3}(?:\.\d{3})+,\d+", digits):
        return (digits.replace(".", "").replace(",", ".") + unit,)
    if re.fullmatch(r"[+-]?\d{1,3}(?:,\d{3})+\.\d+|[+-]?\d{1,3}(?:,\d{3}){2,}", digits):
        return (digits.replace(",", "") + unit,)
    decimal = digits.replace(",", ".", 1) + unit
    if re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", digits):
        return digits.replace(",", "") + unit, decimal
    return (decimal,)


def _meant_degrees(number: float) -> float:
    """Usual angle in degrees that a number in radians equals; 0 if there is none.

    Within a thousandth, as three digits have it: 0.785, 1.047 and 1.571 are 45, 60 and 90 degrees.
    """
    turned = math.degrees(abs(number))
    return next((usual for usual in _USUAL_ANGLES if abs(turned - usual) <= 1e-3 * usual), 0.0)


def number_in(value: object) -> float | None:
    """Plain number that a text states, such as 0.2 for "20 %"; None if it states none."""
    try:
        return parse_quantity(value, "number") if isinstance(value, str) else None
    except CaseError:
        return None


def normal_unit(text: str) -> str:
    """Bring the spelling of a unit to that of the table: ``"N mm"``, ``"N·mm"`` to ``"N*mm"``."""
    unit = text.strip()
    for old, new in _REPLACED:
        unit = unit.replace(old, new)
    unit = re.sub(r" *([*/^]) *", r"\1", unit)
    return re.sub(r" +", "*", unit)


def _kind(wanted: Dimension) -> str:
    return wanted.phrase.split(" ", 1)[1]


def _not_text(value: object, wanted: Dimension) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"found {shown(value)} without a unit; {_with_unit(shown(value), wanted)}"
    return f"found {shown(value)}; expected {wanted.phrase} such as {shown(wanted.example)}"


def _with_unit(number: str, wanted: Dimension) -> str:
    """Ask for the unit of a bare number: which one is meant, only the user knows."""
    hint = f', for instance "{number} {wanted.unit}"' if len(number) <= 20 and wanted.unit else ""
    units = listed(unit for unit in wanted.units if unit)
    choice = f"; which unit is it? {units}" if units else ""
    return f"expected {wanted.phrase} in quotes with its unit{hint}{choice}"


def _wrong_unit(text: str, unit: str, wanted: Dimension) -> str:
    """Say what is wrong with a unit, given as it is written."""
    expected = f"expected {wanted.phrase} such as {shown(wanted.example)}"
    if unit == "":
        return f"found {shown(text)} without a unit; {_with_unit(text.strip(), wanted)}"
    spelled = SPOKEN_UNITS.get(unit.lower(), normal_unit(unit))
    guess = next((u for u in (spelled, f"{spelled}f") if u in wanted.units), None)
    dimension = next((d for d in DIMENSIONS.values() if spelled in d.units), None)
    if dimension is not None and dimension is not wanted:
        # a mass has a weight: "kg" may stand for "kgf"
        question = "" if guess is None else f' did you mean "{guess}"?'
        return f"found {shown(text)}, which is {dimension.phrase};{question} {expected}"
    guess = guess or nearest(unit, wanted.units)
    question = f' did you mean "{guess}"?' if guess is not None else ""
    return (
        f"found {shown(text)} with the unknown unit {shown(unit)};{question} {expected}; "
        f"units: {listed(u for u in wanted.units if u)}"
    )
