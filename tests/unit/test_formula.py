"""Formulas: precedence, functions, refusals. Expected values by hand."""

import numpy as np
import pytest

from gradedesign.common.values.formula import DEEPEST, LONGEST, evaluate_formula, parse_formula
from gradedesign.errors import CaseError


def value(text, **at):
    point = {name: np.asarray(at.get(name, 0.0)) for name in "xyzd"}
    return evaluate_formula(parse_formula(text), point)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 - 2 - 3", -4),
        ("8 / 4 / 2", 1),
        ("2 ^ 3 ^ 2", 512),
        ("-3 ^ 2", -9),
        ("2 ^ -1", 0.5),
        ("--2", 2),
        ("1.5e1 + .5", 15.5),
        ("(1 + 2) * 3", 9),
        ("min(3, 1, 2)", 1),
        ("max(3, 1)", 3),
        ("abs(-2) + sqrt(9)", 5),
        ("log(exp(2))", 2),
        ("sin(pi / 2) + cos(0)", 2),
        ("clamp(5, 0, 1)", 1),
        ("clamp(-5, 0, 1)", 0),
        ("smoothstep(10, 20, 15)", 0.5),
        ("smoothstep(0, 1, 0.25)", 3 / 16 - 2 / 64),
        ("smoothstep(20, 10, 30)", 0),
    ],
)
def test_values(text, expected):
    assert float(value(text)) == pytest.approx(expected, rel=1e-14)


def test_variables_take_their_place():
    x = np.array([1.0, 2.0])
    np.testing.assert_array_equal(value("x + 10*y + 100*z + 1000*d", x=x, y=1, z=2, d=3), 3210 + x)
    assert parse_formula("x + d").variables == {"x", "d"}


def test_a_constant_has_the_shape_of_the_points():
    assert value("0.3", x=np.zeros((2, 3))).shape == (2, 3)


def test_not_defined_is_not_finite_and_warns_nothing():
    assert not np.isfinite(value("1 / x + log(y)", x=0.0, y=-1.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the end"),
        ("x +", "the end"),
        ("x y", '"y" at character 3'),
        ("2x", "an operator"),
        ("x ** 2", r"x\^2"),
        ("(x", r"expected \)"),
        ("x)", r'found "\)"'),
        ("sin x", r"\( after sin"),
        ("sin(x, y)", "takes 1 arguments, found 2"),
        ("max(x)", "takes 2 to 8 arguments, found 1"),
        ("smothstep(0, 1, x)", 'did you mean "smoothstep"'),
        ("r", "unknown name"),
        ("x.real", r'found "\."'),
        ("x[0]", r'found "\["'),
        ("'a'", "found"),
        ("1e999", "too large"),
        ("x = 1", "found"),
        ("x; y", "found"),
        ("__import__(1)", "unknown name"),
        ("x²", "found"),
        ("(" * (DEEPEST + 2) + "x" + ")" * (DEEPEST + 2), "nests deeper"),
        ("2^" * (DEEPEST + 2) + "2", "nests deeper"),
        ("1+" * LONGEST + "1", "at most"),
    ],
)
def test_refusals_say_what_and_where(text, words):
    with pytest.raises(CaseError, match=words):
        parse_formula(text)


def test_long_sums_and_many_signs_are_no_depth():
    assert float(value("+".join(["1"] * 400))) == 400
    assert float(value("-" * 501 + "1")) == -1
