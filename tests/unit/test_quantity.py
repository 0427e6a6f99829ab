"""Quantities: every unit has its exact factor, everything else is refused with a useful message."""

import math
import time

import pytest

from gradedesign.common.values.quantity import normal_unit, parse_quantity
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.errors import CaseError

# Origin of the factors: the SI prefixes; inch = 25.4 mm, pound = 0.45359237 kg and standard
# gravity = 9.80665 m/s^2 by definition (NIST SP 811, appendix B)
EXACT = [
    ("5 kN", "force", 5000.0),
    ("-5kN", "force", -5000.0),
    ("1 lbf", "force", 4.4482216152605),
    ("2 kgf", "force", 19.6133),
    ("1 inch", "length", 25.4),
    ("2.5 ft", "length", 762.0),
    ("35 um", "length", 0.035),
    ("1 in^2", "area", 645.16),
    ("210 GPa", "stress", 210e3),
    ("1 psi", "pressure", 0.006894757293168361),
    ("30 Msi", "stress", 206842.7187950508),
    ("2 bar", "pressure", 0.2),
    ("7850 kg/m^3", "density", 7.85e-9),
    ("4.43 g/cm^3", "density", 4.43e-9),
    ("1 lb/in^3", "density", 2.7679904710203123e-8),
    ("-9.81 m/s^2", "acceleration", -9810.0),
    ("1 g", "acceleration", 9806.65),
    ("60 K", "temperature", 60.0),
    ("12 um/m/K", "thermal_expansion", 12e-6),
    ("8.6e-6 1/K", "thermal_expansion", 8.6e-6),
    ("20 min", "time", 1200.0),
    ("8 GB", "memory", 8e9),
    ("2 GiB", "memory", 2147483648.0),
    ("90 deg", "angle", 90.0),
    (f"{math.pi} rad", "angle", 180.0),
    ("20 N*m", "moment", 20e3),
    ("3 kNm", "moment", 3e6),
    ("0.3", "number", 0.3),
    ("30 %", "number", 0.3),
]


@pytest.mark.parametrize(("text", "dimension", "value"), EXACT)
def test_exact_factor(text, dimension, value):
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", ["7 N*mm", "7 N mm", "7 N·mm", "7 N * mm", " 7  N  mm ", "7 Nmm"])
def test_spellings_of_one_unit(text):
    assert parse_quantity(text, "moment") == 7.0


def test_spelling_with_signs_of_print():
    assert normal_unit(" m/s² ") == "m/s^2"
    assert normal_unit("µm / m / K") == "um/m/K"
    assert parse_quantity("15°", "angle") == 15.0


HOSTILE = [
    "9**9**9",
    "__import__('os')",
    "1" * 5000 + " N",
    "(1+1) N",
    "1e99999 N",
    "0x10 N",
    "1_000 N",
    "nan N",
    "inf N",
    "٣ N",
    "1,5 N",
    "5.5.5 N",
    "1 2 N",
    "N",
    "",
    " ",
    "5\nN",
    "5 N\x00",
    "--5 N",
    "5 N; rm -rf /",
    "1e400 N",
    "1e-400 N",
]


@pytest.mark.parametrize("text", HOSTILE, ids=lambda t: repr(t)[:24])
def test_hostile_text_is_refused_at_once(text):
    start = time.perf_counter()
    with pytest.raises(CaseError) as caught:
        parse_quantity(text, "force")
    assert time.perf_counter() - start < 0.1
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) < 400


@pytest.mark.parametrize(
    "value", [5, 5.0, True, None, ["5 N"], {"a": 1}, 10**5000], ids=lambda v: type(v).__name__
)
def test_only_text_is_a_quantity(value):
    with pytest.raises(CaseError, match="expected a force"):
        parse_quantity(value, "force")


def test_wrong_dimension_names_both():
    with pytest.raises(CaseError) as caught:
        parse_quantity("5 mm", "force")
    assert str(caught.value) == ('found "5 mm", which is a length; expected a force such as "5 kN"')


def test_missing_unit_shows_how():
    with pytest.raises(CaseError, match='"210" without a unit; expected a pressure or stress'):
        parse_quantity("210", "stress")
    with pytest.raises(CaseError, match='for instance "210 MPa"'):
        parse_quantity(210, "stress")


def test_misspelled_unit_gets_nearest():
    with pytest.raises(CaseError, match='did you mean "MPa"'):
        parse_quantity("5 MPA", "stress")


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_example_of_every_dimension_parses(dimension):
    assert parse_quantity(DIMENSIONS[dimension].example, dimension) > 0
