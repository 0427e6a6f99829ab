"""Formulas: any text is either refused by name or evaluated as Python's own arithmetic says."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.common.values.formula import evaluate_formula, parse_formula
from gradedesign.errors import CaseError

POINT = {"x": 0.7, "y": -1.3, "z": 2.1, "d": 0.4}


@st.composite
def expressions(draw, depth=4):
    """A formula and its value, computed by Python."""
    kind = draw(st.integers(0, 7)) if depth else 0
    if kind == 0:
        name = draw(st.sampled_from(["x", "y", "z", "d", "1.25", ".5", "3e-1"]))
        return name, POINT[name] if name in POINT else float(name)
    a, first = draw(expressions(depth - 1))
    if kind == 1:
        return f"abs({a})", abs(first)
    if kind == 2:
        return f"-({a})", -first
    if kind == 3:
        return f"sin( {a} )", math.sin(first)
    b, second = draw(expressions(depth - 1))
    if kind == 4:
        return f"{a} + {b}", first + second
    if kind == 5:
        return f"{a} - ({b})", first - second
    if kind == 6:
        return f"({a})*({b})", first * second
    return f"clamp(min({a}, {b}), -1, 1)", min(max(min(first, second), -1.0), 1.0)


@settings(max_examples=80, deadline=None)
@given(expressions())
def test_equals_the_same_arithmetic_in_python(pair):
    text, expected = pair
    found = evaluate_formula(parse_formula(text), {k: np.array(v) for k, v in POINT.items()})
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(
        st.text(max_size=60),
        st.text(alphabet="xyzd0123456789.e+-*/^(), minmaxsqrtclap", max_size=60),
    )
)
def test_any_text_is_refused_by_name_or_evaluated(text):
    try:
        formula = parse_formula(text)
    except CaseError:
        return
    found = evaluate_formula(formula, {k: np.full(3, v) for k, v in POINT.items()})
    assert found.shape == (3,)
    assert found.dtype == np.float64
