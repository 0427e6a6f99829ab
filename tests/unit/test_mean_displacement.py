"""Mean displacement of a region: against the work of an even load, by differences, from a case."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.load_case import PartLoadCase, region_nodes, region_shares
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.mean_displacement import MeanDisplacementLimit
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.state import solved_state

LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.4),
    strength=(0.4, 1.3),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.3),
)
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6,
    yield_strength=10.0, thermal_expansion=2e-5,
)  # fmt: skip
SIDE, TRACTION = 6.0, np.array([0.1, 0.0, -0.3])


def sheared_bar(order=2):
    """A held bar under an even traction on its tip; its model, space and facets of the tip."""
    mesh = box_part_mesh((20.0, SIDE, SIDE), 3.0)
    space = tet_space(mesh, order)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 20.0 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="pull",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, TRACTION),
        acceleration=np.zeros(3),
        temperature_change=0.0,
    )
    model = homogenised_model(space, np.zeros(space.element_count), MATERIAL, LAW, [case])
    return model, space, tip


def limit_on(space, tip, component):
    return MeanDisplacementLimit(
        key=LimitKey(kind="mean_displacement", region="tip", load_case="pull"),
        name="mean displacement of tip",
        allowed=1.0,
        nodes=region_nodes(space, tip),
        shares=region_shares(space, tip),
        component=component,
    )


@pytest.mark.parametrize("order", [1, 2])
def test_an_even_traction_does_its_force_times_the_mean(order):
    model, space, tip = sheared_bar(order)
    state = solved_state(model, np.full(model.volumes.shape, 0.3), [])
    u = state.displacement("pull")
    mean = u[:, region_nodes(space, tip)] @ region_shares(space, tip)
    work = float((state.force("pull") * u).sum())
    assert TRACTION * SIDE**2 @ mean == pytest.approx(work, rel=1e-12)
    value = limit_on(space, tip, 2).predict(state).value
    assert value == pytest.approx(abs(mean[2]), rel=1e-12)
    whole = limit_on(space, tip, None)
    lengths = np.linalg.norm(u[:, region_nodes(space, tip)], axis=0)
    length = lengths @ region_shares(space, tip)
    assert whole.predict(state).value == pytest.approx(length, rel=1e-12)
    # The tip bends and sinks nearly as one: its mean length is hardly more than that of the mean.
    assert np.linalg.norm(mean) < length < 1.01 * np.linalg.norm(mean)
    twice = replace(whole, factor=2.0).predict(state).value
    assert twice == pytest.approx(2 * length, rel=1e-12)


def turned(points, angle):
    """Displacement of points ``(3, n)`` that turn about the middle of the tip by a small angle."""
    y, z = points[1] - SIDE / 2, points[2] - SIDE / 2
    return angle * np.stack([np.zeros_like(y), -z, y])


def test_a_face_that_twists_about_its_middle_is_not_at_rest():
    _, space, tip = sheared_bar()
    state = SimpleNamespace(displacement=lambda _: turned(space.nodes, 0.01))
    # The mean distance of a square from its middle: (sqrt 2 + arsinh 1) / 6 of its side, 0.3826;
    # midpoints of facets of half its side hold it to 2 %.
    exact = 0.01 * SIDE * (np.sqrt(2) + np.arcsinh(1)) / 6
    assert limit_on(space, tip, None).predict(state).value == pytest.approx(exact, rel=0.02)
    for component in (1, 2):
        assert limit_on(space, tip, component).predict(state).value == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("component", [0, 2, None])
def test_the_gradient_matches_central_differences(component):
    model, space, tip = sheared_bar()
    limit = replace(limit_on(space, tip, component), factor=1.1)
    rng = np.random.default_rng(80521)
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


CASE = (
    held_bar(box_part(60, 10, 10, 5), name="bar", load_case="down")
    + """\
[limits]
mean_displacement = [{region = "tip", component = "z", magnitude = "5 x solid"}]
compliance = [{work = "9 x solid"}]
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
)


@pytest.fixture
def folder(tmp_path):
    def write(*swaps):
        text = CASE
        for old, new in swaps:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        return tmp_path

    return write


def test_a_case_file_limits_the_mean(folder):
    case = gradedesign.load_case(folder())
    result = gradedesign.run(case, folder=folder() / "run")
    work, mean = result.solid
    assert (mean.name, mean.unit) == ("mean displacement of tip z", "mm")
    assert mean.measure == "mean over the area of the region"
    force = case.load_case[0].load[0].force
    assert work.value == pytest.approx(abs(force[2]) * mean.value, rel=1e-6)
    row = result.limits[1]
    assert row.limit == pytest.approx(5 * mean.value, rel=1e-9)
    assert row.utilisation == pytest.approx(0.998, abs=0.005)


def test_check_lists_the_limit(cli, folder):
    data = json.loads(cli("check", folder(), "--json").out)
    assert {"name": "mean displacement of tip z", "load_case": "down", "allowed": "5 x solid"} in (
        data["limits"]
    )


def test_a_load_case_that_holds_the_region_does_not_judge_it(folder):
    """A limit of no displacement would always hold there."""
    held = """\
[[load_case]]
name = "back"
fix = [{region = "tip"}]
load = [{region = "root", force = ["0 N", "0 N", "10 N"]}]
[limits]
"""
    case = gradedesign.load_case(folder(("[limits]\n", held), ('"sizing"', '"solid"')))
    result = gradedesign.run(case, folder=folder() / "run")
    cases = [row.load_case for row in result.solid if row.key.kind == "mean_displacement"]
    assert cases == ["down"]
    assert any("tip z is not judged in load case 'back'" in text for text in result.warnings)


@pytest.mark.parametrize(
    ("swap", "words"),
    [
        (
            ('region = "tip", component', 'region = "root", component'),
            "hold the whole region 'root'",
        ),
        (('region = "tip", component', 'region = "tipp", component'), 'did you mean "tip"'),
        (('"5 x solid"', '"2 kN"'), "limits.mean_displacement[0].magnitude: found"),
    ],
)
def test_what_cannot_be_meant_is_refused(cli, folder, swap, words):
    ended = cli("check", folder(swap))
    assert ended.code == 2
    assert words in ended.err


def test_without_a_component_the_mean_length_is_judged(folder):
    """A bar twisted at its tip: what the twist moves is judged, and told as such."""
    case = gradedesign.load_case(
        folder(
            ('component = "z", magnitude = "5 x solid"', 'magnitude = "1 mm"'),
            ('force = ["0 N", "0 N", "-10 N"]', 'moment = ["0.1 N*m", "0 N*m", "0 N*m"]'),
            ("compliance = [", "displacement = ["),
            ('{work = "9 x solid"}', '{region = "tip", magnitude = "1 mm"}'),
            ('"sizing"', '"solid"'),
        )
    )  # fmt: skip
    result = gradedesign.run(case, folder=folder() / "run")
    largest, mean = result.solid
    assert mean.measure == "mean length over the area of the region"
    # Corners lie 1.848 times as far from the middle of a square as its points on average.
    assert largest.value / mean.value == pytest.approx(0.5 * np.sqrt(2) / 0.3826, rel=0.03)
