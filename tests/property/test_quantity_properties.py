"""Whatever is written, a quantity is the right number or a CaseError; a case file likewise."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gradedesign.common.values.quantity import parse_quantity
from gradedesign.common.values.toml_lines import key_lines
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.design.case.read_case import load_case
from gradedesign.errors import CaseError

UNITS = [(name, unit) for name, d in DIMENSIONS.items() for unit in d.units]
QUICK = settings(
    deadline=2000,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

VALID = """\
[case]
name = "cantilever"
[part]
box = ["60 mm", "20 mm", "20 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "tip load"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-50 N"]}]
[limits]
stress = "50 MPa"
displacement = [{region = "tip", component = "z", magnitude = "2 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.10, 0.65]
"""


@given(
    number=st.floats(min_value=-1e6, max_value=1e6, allow_subnormal=False),
    unit=st.sampled_from(UNITS),
)
def test_value_is_number_times_factor(number, unit):
    dimension, name = unit
    expected = number * DIMENSIONS[dimension].units[name]
    assert parse_quantity(f"{number!r} {name}", dimension) == expected


@given(text=st.text(max_size=120), dimension=st.sampled_from(list(DIMENSIONS)))
def test_any_text_gives_a_finite_number_or_case_error(text, dimension):
    try:
        value = parse_quantity(text, dimension)
    except CaseError:
        return
    assert math.isfinite(value)


@given(text=st.from_regex(r"[+-]?[0-9.eE*+()_ ]{0,40}[a-zA-Z/*^0-9]{0,10}", fullmatch=True))
def test_arithmetic_is_never_evaluated(text):
    try:
        value = parse_quantity(text, "force")
    except CaseError:
        return
    number = text.strip().rstrip("kNMmlbfg ")
    assert abs(value) <= abs(float(number)) * 1e6  # the largest factor, of MN


@QUICK
@given(content=st.binary(max_size=400))
def test_random_bytes_only_raise_case_error(tmp_path, content):
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    with pytest.raises(CaseError):
        load_case(path)


@QUICK
@given(content=st.text(alphabet="[]{}=\"',.#\n\\ab1-_ ", max_size=200))
def test_random_toml_like_text_only_raises_case_error(tmp_path, content):
    path = tmp_path / "case.toml"
    path.write_text(content)
    with pytest.raises(CaseError):
        load_case(path)


_PIECES = st.one_of(
    st.text(max_size=6),
    st.sampled_from(
        ["[", "]", "{", "}", '"', "=", "\n", "[[a]]", "1e999", "nan", "true", '"""', "''", "-5 N"]
    ),
)


@QUICK
@given(
    start=st.integers(0, len(VALID)),
    length=st.integers(0, 40),
    piece=_PIECES,
)
def test_mutated_case_loads_or_raises_case_error(tmp_path, start, length, piece):
    path = tmp_path / "case.toml"
    text = VALID[:start] + piece + VALID[start + length :]
    path.write_text(text.encode("utf-8", "replace").decode())
    try:
        case = load_case(path)
    except CaseError:
        return
    assert min(case.lattice.size) > 0


def _values(depth):
    leaves = st.one_of(
        st.booleans(),
        st.integers(-9, 9),
        st.floats(allow_nan=False),
        st.sampled_from(["5 kN", "2 mm", "root", "free", "none", "x = min", "", "a" * 90]),
    )
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.lists(inner, max_size=3),
            st.dictionaries(st.sampled_from(["region", "point", "not", "zz"]), inner, max_size=2),
        ),
        max_leaves=depth,
    )


def _toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + "}"
    return repr(value)


_ASSIGNMENTS = [i for i, row in enumerate(VALID.split("\n")) if " = " in row]


@QUICK
@given(row=st.sampled_from(_ASSIGNMENTS), value=_values(5))
def test_any_value_at_any_key_loads_or_raises_case_error(tmp_path, row, value):
    rows = VALID.split("\n")
    rows[row] = rows[row].split(" = ")[0] + " = " + _toml(value)
    path = tmp_path / "case.toml"
    path.write_text("\n".join(rows))
    told = _problems(path)
    # one line per problem, each with its place
    assert all(line.startswith("case.toml:") for line in told)


def _problems(path):
    try:
        load_case(path)
    except CaseError as error:
        return str(error).split("\n")[1:]
    return []


@given(content=st.text(alphabet="[]{}=\"',.#\n\\ab1 ", max_size=120))
def test_scan_never_fails(content):
    count = content.count("\n") + 1
    assert all(1 <= line <= count for line in key_lines(content).values())
