"""Compliance: the work of the loads, by hand, by differences and from a case file."""

from dataclasses import replace

import numpy as np
import pytest

import gradedesign
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.compliance import ComplianceLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.filter import uniform_filter
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.size import SizingProblem, size
from gradedesign.mechanics.sizing.state import solved_state

# Poisson's ratio 0: a pulled bar is in uniaxial stress although its root is held.
LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.4),
    strength=(0.4, 1.3),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.0),
)
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.0, density=1e-6,
    yield_strength=10.0, thermal_expansion=2e-5,
)  # fmt: skip
LENGTH, SIDE, STRESS = 20.0, 6.0, 0.5
LIMIT = ComplianceLimit(
    key=LimitKey(kind="compliance", load_case="pull"), name="work of the loads", allowed=1.0
)


def bar(acceleration=(0.0, 0.0, 0.0), temperature=0.0, traction=STRESS):
    mesh = box_part_mesh((LENGTH, SIDE, SIDE), 3.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > LENGTH - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="pull",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([traction, 0.0, 0.0])),
        acceleration=np.asarray(acceleration),
        temperature_change=temperature,
    )
    return homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])


def by_hand(rho, stress=STRESS):
    """F^2 L / (E A) with E = 1000 * 0.6 rho^1.4, N mm."""
    force, area = stress * SIDE**2, SIDE**2
    return force**2 * LENGTH / (1000.0 * 0.6 * rho**1.4 * area)


def test_the_work_on_a_pulled_bar_is_that_by_hand():
    model = bar()
    state = solved_state(model, np.full(model.volumes.shape, 0.3), [LIMIT])
    assert LIMIT.predict(state).value == pytest.approx(by_hand(0.3), rel=1e-4)
    twice = replace(LIMIT, factor=2.0)
    assert twice.predict(state).value == pytest.approx(2 * by_hand(0.3), rel=1e-4)


@pytest.mark.parametrize(
    ("acceleration", "temperature"),
    [((0.0, 0.0, 0.0), 0.0), ((3e4, 0.0, -2e4), 0.0), ((3e4, 0.0, 0.0), 60.0)],
    ids=["force", "inertia", "inertia and heat"],
)
def test_the_gradient_matches_central_differences(acceleration, temperature):
    model, limit = bar(acceleration, temperature), replace(LIMIT, factor=1.1)
    rng = np.random.default_rng(61207)
    rho = rng.uniform(0.2, 0.5, model.volumes.shape)
    system = homogenised_system(model, rho)
    state = solved_state(model, rho, [limit], system)
    responses = limit.responses(state)
    adjoints = solve_adjoints(model, system, responses)
    gradient = response_gradients(state, responses, adjoints)[0]
    direction, step = rng.standard_normal(rho.size), 1e-4
    ahead, back = (
        limit.predict(solved_state(model, rho + s * step * direction, [limit])).value
        for s in (1, -1)
    )
    assert gradient @ direction == pytest.approx((ahead - back) / (2 * step), rel=2e-4)


def test_sizing_ends_where_the_work_by_hand_is_the_limit():
    model = bar()
    problem = SizingProblem(
        model=model, limits=(replace(LIMIT, allowed=by_hand(0.3)),), bounds=(0.06, 0.85),
        filter=uniform_filter(model.space.element_count),
    )  # fmt: skip
    result = size(problem, tolerance=2e-4)
    assert result.feasible
    np.testing.assert_allclose(result.rho, 0.3, rtol=1e-3)


CASE = """\
[case]
name = "bar"
[part]
box = ["40 mm", "10 mm", "10 mm"]
mesh_size = "5 mm"
[region.root]
plane = "x = min"
[region.side]
plane = "y = min"
[region.under]
plane = "z = min"
[region.tip]
plane = "x = max"
[material]
youngs_modulus = "2 GPa"
poissons_ratio = 0.3
density = "1 g/cm^3"
[[load_case]]
name = "pull"
fix = [
  {region = "root", components = "x"}, {region = "side", components = "y"},
  {region = "under", components = "z"},
]
load = [{region = "tip", force = ["200 N", "0 N", "0 N"]}]
[limits]
compliance = [{load_case = "pull", work = "3 x solid"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
grading = "uniform"
density = [0.2, 0.6]
[run]
stop_after = "sizing"
[output]
formats = []
"""


def test_a_case_file_limits_the_work(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    (row,), (solid,) = result.limits, result.solid
    # F^2 L / (E A) of the solid bar, which slides on its sides: 200^2 * 40 / (2000 * 100) N mm.
    assert solid.value == pytest.approx(8.0, rel=1e-6)
    assert (row.name, row.unit, row.stated) == ("work of the loads", "N mm", "3 x solid")
    assert row.limit == pytest.approx(24.0, rel=1e-6)
    assert row.utilisation == pytest.approx(0.998, abs=0.005)


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        (('work = "3 x solid"', 'work = "3 mm"'), "limits.compliance[0].work: found"),
        (('"3 x solid"', '"0.5 x solid"'), "the solid part itself breaks"),
        (('load_case = "pull", work', 'load_case = "pul", work'), 'did you mean "pull"'),
        (("work =", "energy ="), "limits.compliance[0].energy: unknown key"),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path, swap, words):
    (tmp_path / "case.toml").write_text(CASE.replace(*swap), encoding="utf-8")
    with pytest.raises(gradedesign.CaseError) as error:
        gradedesign.load_case(tmp_path)
    assert words in str(error.value)


HOT = """\
[[load_case]]
name = "hot"
fix = [
  {region = "root", components = "x"}, {region = "side", components = "y"},
  {region = "under", components = "z"},
]
temperature_change = "40 K"
[limits]
"""
EXPANSION = 'thermal_expansion = "2e-5 1/K"\n[[load_case]]'
MOVED = HOT.replace("hot", "moved").replace(
    'temperature_change = "40 K"\n', ""
).replace(
    '{region = "root", components = "x"}',
    '{region = "root", components = "x"}, {region = "tip", displacement = '
    '["0.1 mm", "free", "free"]}',
)  # fmt: skip


@pytest.mark.parametrize("idle", [HOT, MOVED], ids=["heated", "moved"])
def test_a_load_case_without_loads_is_not_judged_by_their_work(tmp_path, idle):
    text = CASE.replace("[limits]\n", idle).replace('load_case = "pull", work', "work")
    text = text.replace("[[load_case]]", EXPANSION, 1)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    (row,) = result.limits
    # As without the load case beside it.
    assert (row.load_case, row.limit) == ("pull", pytest.approx(24.0, rel=1e-6))
    name = "hot" if idle is HOT else "moved"
    told = f"work of the loads is not judged in load case '{name}', which has no loads"
    assert any(told in warning for warning in result.warnings)


@pytest.mark.parametrize("entry", ['{load_case = "hot", work', "{work"], ids=["named", "every"])
def test_work_limited_where_no_load_acts_is_refused_before_any_mesh(cli, tmp_path, entry):
    text = CASE.replace('{load_case = "pull", work', entry).replace("[limits]\n", HOT)
    begin, end = text.index("[[load_case]]"), text.index('[[load_case]]\nname = "hot"')
    text = text if "hot" in entry else text[:begin] + text[end:]
    text = text.replace("[[load_case]]", EXPANSION, 1)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    answer = cli("check", tmp_path)
    assert answer.code == 2
    line = next(n for n, words in enumerate(text.split("\n"), 1) if words.startswith("compliance"))
    words = " ".join(answer.err.split())
    assert f"case.toml:{line}: limits.compliance[0]: load case 'hot' has no force" in words
