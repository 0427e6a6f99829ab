"""One density for the whole part: the least at which every limit holds as it is judged."""

from dataclasses import replace

import numpy as np
import pytest

import gradedesign
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets, centroids
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.fe.facets import facet_nodes
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.filter import cone_filter, uniform_filter
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.size import SizingProblem, size
from gradedesign.mechanics.sizing.state import solved_state

LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.8),
    strength=(0.5, 1.4),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6, yield_strength=10.0
)
BOUNDS = (0.06, 0.85)


def l_bracket(*, acceleration=(0.0, 0.0, 0.0), share=0.0):
    """An L of 40 x 10 x 40 mm with arms of 10 mm, held on top and pulled down at its end."""
    box = box_part_mesh((40.0, 10.0, 40.0), 5.0)
    x, _, z = centroids(box)
    used, tets = np.unique(box.tets[:, (x < 10) | (z < 10)], return_inverse=True)
    mesh = TetMesh(points=box.points[:, used], tets=np.asarray(tets).reshape(4, -1))
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    px, _, pz = mesh.points[:, facets]
    root, tip = facets[(pz > 40 - 1e-9).all(axis=1)], facets[(px > 40 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="pull",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.0, 0.0, -0.05])),
        acceleration=np.asarray(acceleration),
    )
    solid = np.full(space.element_count, share)
    model = homogenised_model(space, solid, MATERIAL, LAW, [case])
    limit = DisplacementLimit(
        key=LimitKey(kind="displacement", region="tip", load_case="pull"),
        name="tip", component=None, allowed=1e3,
        nodes=np.unique(facet_nodes(space, tip)),
    )  # fmt: skip
    return model, limit


def problem_of(model, limit, *, stress=None, target=1.0):
    count = model.space.element_count
    judged = ()
    if stress is not None:
        evaluated = centroids(model.space.mesh)[2] < 36.0
        judged = (
            StressLimit(
                key=LimitKey(kind="stress", region="lattice"), name="stress in lattice",
                allowed=stress, percentile=99.5, evaluated=evaluated,
            ),
        )  # fmt: skip
    return SizingProblem(
        model=model, limits=(limit, *judged), bounds=BOUNDS,
        filter=uniform_filter(count), target=target,
    )  # fmt: skip


def worst_utilisation(problem, density):
    """The largest utilisation of any limit at one density, by the functions that judge."""
    rho = np.full(problem.model.space.element_count, density)
    state = solved_state(problem.model, rho, problem.limits)
    return max(one.predict(state).value / one.allowed for one in problem.limits)


@pytest.mark.parametrize("target", [1.0, 0.985])
def test_a_uniform_bracket_uses_its_stress_limit(target):
    """The percentile governs, not the neediest element in the corner of the L."""
    model, limit = l_bracket()
    problem = problem_of(model, limit, stress=25.0, target=target)
    steps = []
    result = size(problem, tolerance=0.002, on_step=steps.append)
    assert result.converged
    assert result.feasible
    density = result.rho[0]
    np.testing.assert_array_equal(result.rho, density)
    assert target * 0.998 <= result.history[-1].utilisations[-1] <= target
    assert result.history[-1].utilisations[-1] == pytest.approx(
        worst_utilisation(problem, density), rel=1e-9
    )
    # Least: two per cent less and the limit is missed; the bounds do not decide.
    assert worst_utilisation(problem, 0.98 * density) > target
    assert BOUNDS[0] < density < BOUNDS[1]
    assert tuple(steps) == result.history
    assert [s.iteration for s in steps] == list(range(len(steps)))
    assert len(steps) <= 12


@pytest.mark.parametrize("start", [0.07, 0.3, 0.8])
def test_the_answer_does_not_depend_on_the_start(start):
    model, limit = l_bracket()
    problem = problem_of(model, replace(limit, allowed=6.0), stress=60.0)
    result = size(problem, start=np.array([start]), tolerance=1e-3)
    assert result.history[-1].utilisations[0] == pytest.approx(1.0, abs=1.001e-3)
    assert result.feasible
    # Every use is that of one density: u = c rho^-1.8 in a part that is all lattice.
    known = worst_utilisation(problem, 0.5)
    assert result.rho[0] == pytest.approx(0.5 * known ** (1 / 1.8), rel=2e-3)


def test_bounds_decide_where_limits_do_not():
    model, limit = l_bracket()
    slack = size(problem_of(model, replace(limit, allowed=1e6)))
    assert slack.rho[0] == BOUNDS[0]
    assert slack.feasible
    hard = size(problem_of(model, replace(limit, allowed=1e-3)))
    assert hard.rho[0] == BOUNDS[1]
    assert not hard.feasible
    assert hard.history[-1].utilisations[0] > 1


def test_no_displacement_limit_and_no_lattice_left_out_of_the_judgement():
    model, limit = l_bracket()
    problem = problem_of(model, limit, stress=25.0)
    problem = replace(problem, limits=problem.limits[1:])
    assert size(problem).history[-1].utilisations[-1] == pytest.approx(1.0, rel=0.005)


def test_the_least_density_where_weight_bends_the_part(caplog):
    """Under its own weight beside some solid, more lattice bends the part more, then less."""
    model, limit = l_bracket(acceleration=(0.0, 0.0, -9.81e3), share=0.1)
    weight = tuple(replace(case, force=np.zeros_like(case.force)) for case in model.cases)
    problem = problem_of(replace(model, cases=weight), replace(limit, allowed=1.8))
    # At 0.06, 0.3 and 0.85: 1.72, 2.64 and 1.98 mm. Only densities near the lower bound hold.
    assert [worst_utilisation(problem, r) < 1 for r in (0.06, 0.3, 0.85)] == [True, False, False]
    result = size(problem, start=np.array([0.3]))
    assert (result.rho[0], result.feasible) == (BOUNDS[0], True)
    assert caplog.text == ""
    # Where not even they hold, the answer says so, and that the use is not monotone.
    result = size(replace(problem, limits=(replace(limit, allowed=1.6),)))
    assert not result.feasible
    assert "the largest utilisation rises" in caplog.text


def test_feasible_means_that_the_limits_hold_not_that_the_aim_was_met():
    """Graded, so as not to be uniform's own search: 1 % above an aim of 0.95 is still a design."""
    model, limit = l_bracket()
    count = model.space.element_count
    matrix = cone_filter(centroids(model.space.mesh), model.volumes, 6.0)
    aim = replace(problem_of(model, replace(limit, allowed=6.0), target=0.95), filter=matrix)
    # One iteration from a density that uses the limit to 97 %: over the aim, within the limit.
    known = worst_utilisation(aim, 0.5)
    density = 0.5 * (known / 0.97) ** (1 / 1.8)
    result = size(aim, start=np.full(count, density), max_iterations=1, insistence=1)
    assert result.history[-1].utilisations[0] == pytest.approx(0.97, rel=1e-3)
    assert result.feasible
    over = 0.5 * (known / 1.002) ** (1 / 1.8)
    result = size(replace(aim, target=1.0), start=np.full(count, over), max_iterations=1)
    assert result.history[-1].utilisations[0] == pytest.approx(1.002, rel=1e-3)
    assert not result.feasible


def test_a_graded_bracket_ends_within_its_stress_limit():
    """Steps that shrink are no reason to stop a per cent above the aim."""
    model, limit = l_bracket()
    matrix = cone_filter(centroids(model.space.mesh), model.volumes, 10.0)
    problem = replace(problem_of(model, limit, stress=25.0, target=0.998), filter=matrix)
    result = size(problem)
    assert result.converged
    assert result.feasible
    assert 0.99 <= result.history[-1].utilisations[-1] <= 1.0
    uniform = size(problem_of(model, limit, stress=25.0, target=0.998))
    assert result.history[-1].mass_g < uniform.history[-1].mass_g


CASE = """
[case]
name = "l-bracket"
[part]
file = "part.stl"
units = "mm"
mesh_size = "8 mm"
[region.top]
plane = "z = max"
[region.end]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "pull"
fix = [{region = "top"}]
load = [{region = "end", force = ["0 N", "0 N", "-900 N"]}]
[limits]
stress = "300 MPa"
buckling = "off"
[lattice]
cell = "gyroid-network"
size = "10 mm"
density = [0.15, 0.60]
grading = "uniform"
[run]
stop_after = "sizing"
[output]
formats = []
"""


def test_a_run_of_a_uniform_bracket_reaches_its_aim(tmp_path):
    corners = np.array([[0, 0], [50, 0], [50, 20], [20, 20], [20, 50], [0, 50]], dtype=float)
    at = lambda y: np.stack([corners[:, 0], np.full(6, y), corners[:, 1]], axis=1)  # noqa: E731
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    ring = np.arange(6)
    after = np.roll(ring, -1)
    sides = np.concatenate(
        [np.stack([ring, ring + 6, after], 1), np.stack([after, ring + 6, after + 6], 1)]
    )
    faces = np.concatenate([cap, cap[:, ::-1] + 6, sides])
    surface = SurfaceMesh(vertices=np.concatenate([at(0.0), at(20.0)]), faces=faces)
    write_stl(tmp_path / "part.stl", surface)
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    sizing = result.measures["sizing"]
    assert sizing["converged"]
    assert sizing["feasible"]
    # Sizing aims at 99.8 % where no analysis follows, within 0.4 %.
    assert 0.99 <= result.limits[0].utilisation <= 0.998
    assert sizing["density"][0] == sizing["density"][1]
    assert 0.15 < sizing["density"][0] < 0.60


def test_a_graded_bracket_holds_what_a_uniform_one_holds():
    """The densest lattice attracts the load: the same mass spread evenly would hold."""
    model, limit = l_bracket()
    uniform = problem_of(model, limit, stress=2.8)
    graded = replace(uniform, filter=cone_filter(centroids(model.space.mesh), model.volumes, 6.0))
    heavy, light = size(uniform), size(graded, max_iterations=10)
    # Before, it ended at 110 % with 4168 g.
    assert light.history[-1].utilisation <= 1.01
    assert light.history[-1].mass_g < 0.95 * heavy.history[-1].mass_g


def test_a_graded_design_far_below_its_aim_gets_more_iterations():
    """Sizing whose iterations end far too heavy goes on; what a start keeps, stays."""
    model, limit = l_bracket()
    matrix = cone_filter(centroids(model.space.mesh), model.volumes, 10.0)
    problem = replace(problem_of(model, replace(limit, allowed=6.0), target=0.985), filter=matrix)
    start = np.full(matrix.shape[1], 0.8)
    steps = []
    result = size(problem, start=start, max_iterations=3, on_step=steps.append)
    assert steps[2].utilisation < 0.5
    assert 3 < len(steps) <= 9
    assert 0.97 <= result.history[-1].utilisation <= 0.985 * 1.004
    assert result.history[-1].mass_g < 0.8 * steps[2].mass_g
    state = solved_state(model, result.rho, problem.limits)
    assert limit.predict(state).value / 6.0 == pytest.approx(result.history[-1].utilisation)
    kept = size(problem, start=start, max_iterations=3, keep=0.97)
    assert kept.variables.min() >= 0.97 * 0.8 - 1e-12
