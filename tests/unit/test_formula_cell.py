"""Cells that a case states as a formula: `[lattice.own_cell] maker = "formula"`."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.errors import CaseError, PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.formula_cell import formula_cell
from gradedesign.mechanics.homogenise.cell_properties import cell_properties
from gradedesign.pipeline import run
from gradedesign.program.host.registry import build_registry

GYROID = "sin(2*pi*x)*cos(2*pi*y) + sin(2*pi*y)*cos(2*pi*z) + sin(2*pi*z)*cos(2*pi*x)"
P = "cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)"
REGISTRY = build_registry()
LATTICE = """\
[case]
name = "own"
[part]
box = ["10 mm", "10 mm", "10 mm"]
mesh_size = "5 mm"
[lattice]
cell = "mine"
size = "5 mm"
density = {density}
[lattice.own_cell]
maker = "formula"
formula = "{formula}"
kind = "{kind}"
"""
LOADS = """
[region.foot]
plane = "z = min"
[region.top]
plane = "z = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "press"
fix = [{region = "foot"}]
load = [{region = "top", force = ["0 N", "0 N", "-100 N"]}]
[limits]
stress = "100 MPa"
"""


def written(folder, formula, kind, density="0.3", more=""):
    text = LATTICE.format(formula=formula, kind=kind, density=density)
    (folder / "case.toml").write_text(text + more)
    return folder


@pytest.mark.parametrize("kind", ["sheet", "network"])
def test_the_formula_of_an_installed_cell_is_that_cell(tmp_path, kind):
    """Gyroid: the same field, window, levels, and at 24 voxels the same stiffness and strength."""
    case = load_case(written(tmp_path, GYROID, kind))
    mine = with_own_cell(case.lattice, REGISTRY, case.where).cell_families["mine"]
    theirs = REGISTRY.cell_families[f"gyroid-{kind}"]
    u = np.random.default_rng(7).random((3, 500))
    np.testing.assert_allclose(mine.shape(u), theirs.shape(u), rtol=0, atol=1e-12)
    one, other = calibrate(mine), calibrate(theirs)
    assert mine.sides == theirs.sides
    assert one.window == pytest.approx(other.window, abs=1e-9)
    rho = np.linspace(*one.window, 9)
    np.testing.assert_allclose(one.level_of(rho), other.level_of(rho), atol=1e-12)
    found, expected = (
        cell_properties(calibrate(family), 0.6, resolution=24, with_surface=False)
        for family in (formula_cell("g", formula=GYROID, kind=kind, symmetry="cubic"), theirs)
    )
    np.testing.assert_allclose(found.stiffness, expected.stiffness, rtol=1e-9, atol=1e-12)
    assert found.strength.strength == pytest.approx(expected.strength.strength, rel=1e-9)


def test_check_takes_a_formula(cli, tmp_path):
    folder = written(tmp_path, P, "network", "[0.3, 0.6]", LOADS)
    ended = cli("check", folder, "--no-picture", "--json")
    assert ended.code == 0, ended.err
    data = json.loads(ended.out)
    assert data["cell"] == "mine"
    # Half of the surface's two equal sides, by symmetry; it falls apart at the installed cell's.
    known = calibrate(REGISTRY.cell_families["primitive-network"]).window
    assert data["lattice"]["cell_window"] == pytest.approx(known, abs=1e-9)
    assert data["lattice"]["law"]["to_be_computed"]


def test_generate_prints_a_formula_at_its_density(tmp_path):
    result = run(load_case(written(tmp_path, P, "sheet")), folder=tmp_path / "out")
    # Two cells of five millimetres an edge, each exactly at its density; the surface's facets.
    assert result.relative_density == pytest.approx(0.3, abs=0.01)


def test_a_parameter_of_the_formula_is_one_of_the_cell(tmp_path):
    options = 'parameters = [["bias", 0.0]]\n[lattice.parameters]\nbias = 0.7\n'
    case = load_case(written(tmp_path, P + " + bias * cos(4*pi*x)", "network", "0.5", options))
    mine = with_own_cell(case.lattice, REGISTRY, case.where).cell_families["mine"]
    at = np.array([[0.25], [0.1], [0.3]])
    told = mine.shape(at, **case.lattice.parameters)
    plain = mine.shape(at, **mine.parameters)
    assert told - plain == pytest.approx(0.7 * np.cos(np.pi))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"formula": "cos(2*pi*d)"}, "own_cell.formula: found the unknown name 'd'"),
        ({"formula": "cos(2*pi*x"}, "own_cell.formula: found the end of the formula"),
        ({"formula": 3.0}, "own_cell.formula: found 3.0; expected a text"),
        ({"formula": "1/(x - x)"}, "not defined in 100.0% of the cell"),
        ({"formula": "sqrt(cos(2*pi*x))"}, "not defined in"),
        ({"formula": "2 + 1"}, "it is 3 everywhere"),
        ({"formula": P, "kind": "sheets"}, 'own_cell.kind: found "sheets"; did you mean "sheet"'),
        ({"formula": P, "symmetry": "cube"}, "own_cell.symmetry"),
        ({"formula": P, "parameters": [["a", 1.0]]}, "the formula has no a"),
        ({"formula": P, "parameters": [["pi", 1.0]]}, "own_cell.parameters: found the name"),
        ({"formula": P, "parameters": "a"}, "expected pairs"),
        ({"formula": P, "parameters": [["a", True]]}, "expected pairs"),
    ],
)
def test_what_is_wrong_with_a_formula_is_named(options, said):
    with pytest.raises(CaseError) as caught:
        formula_cell("mine", **options)
    assert said.replace("'", '"') in str(caught.value).replace("'", '"')


def test_a_formula_that_does_not_repeat_is_refused():
    with pytest.raises(PluginError, match="period must be 1"):
        calibrate(formula_cell("mine", formula="cos(2*pi*x) + cos(2*pi*y) + z"))


@settings(max_examples=100, deadline=None)
@given(
    st.one_of(
        st.text(max_size=60),
        st.text(alphabet="xyza0123456789.e+-*/^(), sincosqrtabpi", max_size=60),
    )
)
def test_any_text_is_refused_by_name_or_a_cell(text):
    try:
        cell = formula_cell("mine", formula=text, parameters=[["a", 0.5]])
    except CaseError:
        return
    assert np.isfinite(cell.shape(np.random.default_rng(2).random((3, 4)), a=0.5)).all()
