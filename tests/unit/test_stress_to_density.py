"""The plain method: stress of the solid part to density by a law, and one factor on that stress."""

from dataclasses import replace

import numpy as np
import pytest

import gradedesign
from gradedesign.design.resolve.plan import resolve_case
from gradedesign.design.resolve.solid_part import solid_solutions
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets, centroids
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
from gradedesign.mechanics.sizing.filter import cone_filter, filtered
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.problem import SizingProblem
from gradedesign.mechanics.sizing.stress_to_density import (
    mapped_density,
    size_by_stress,
    solid_demand,
)
from gradedesign.program.host.registry import build_registry

LENGTH, TRACTION = 16.0, 0.5
C_STIFF, N_STIFF, C_STRONG, N_STRONG = 0.6, 1.8, 0.4, 1.3
#: Without lateral strain, so that a bar held on a whole face is stressed in one direction alone.
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.0, density=1e-6, yield_strength=10.0
)
BOUNDS = (0.06, 0.85)
#: Sizing ends where the most used limit is used to between this less and all of its target.
LEFT = 0.004


def law(c=C_STRONG, n=N_STRONG):
    return power_law(
        "test-law",
        ("test",),
        youngs=(C_STIFF, N_STIFF),
        strength=(c, n),
        window=(0.05, 0.9),
        origin=LawOrigin(kind="stated", source="this test", test="none", poissons_ratio=0.0),
    )


def bar(scaling_law=None, *, tractions=(TRACTION,), acceleration=0.0):
    """A bar along x, held at one end and pulled at the other by tractions of as many load cases."""
    mesh = box_part_mesh((LENGTH, 4.0, 4.0), 2.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > LENGTH - 1e-9).all(axis=1)]
    cases = [
        PartLoadCase(
            name=f"pull {k}",
            supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
            force=traction_force(space, tip, np.array([traction, 0.0, 0.0])),
            acceleration=np.array([acceleration, 0.0, 0.0]),
        )
        for k, traction in enumerate(tractions)
    ]
    model = homogenised_model(
        space, np.zeros(space.element_count), MATERIAL, scaling_law or law(), cases
    )
    solid = solid_solutions(space, cases, MATERIAL, model.solver)
    nodes = np.unique(facet_nodes(space, tip))
    return model, solid, nodes


def stress_limit(model, allowed):
    return StressLimit(
        key=LimitKey(kind="stress", region="lattice"),
        name="stress in lattice",
        allowed=allowed,
        percentile=99.5,
        evaluated=np.ones(model.space.element_count, dtype=bool),
    )


def tip_limit(nodes, allowed):
    return DisplacementLimit(
        key=LimitKey(kind="displacement", region="tip", load_case="pull 0"),
        name="tip",
        component=None,
        allowed=allowed,
        nodes=nodes,
    )


def problem_of(model, *limits, target=1.0, windows=None, radius=1e-3):
    points = centroids(model.space.mesh)
    return SizingProblem(
        model=model,
        limits=limits,
        bounds=BOUNDS,
        filter=cone_filter(points, model.volumes, radius),
        windows=windows,
        target=target,
    )


# --- the map --------------------------------------------------------------------------------------


def test_uniform_stress_gives_the_density_of_the_law():
    """sigma = c rho^n allowed, Gibson and Ashby 1997: solved for rho."""
    model, solid, _ = bar()
    problem = problem_of(model)
    found = mapped_density(problem, solid_demand(problem, solid), 5.0)
    expected = (TRACTION / (C_STRONG * 5.0)) ** (1.0 / N_STRONG)
    # The law is inverted on 4,000 intervals: h^2 f'' / 8 is 1e-7 of the density here.
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_stress_that_varies_is_mapped_point_by_point():
    """A bar under its inertia: the mass beyond x pulls there, linearly, down to the bounds."""
    model, solid, _ = bar(tractions=(0.0,), acceleration=5e5)
    problem = problem_of(model)
    found = mapped_density(problem, solid_demand(problem, solid), 20.0)
    stress = MATERIAL.density * 5e5 * (LENGTH - centroids(model.space.mesh)[0])
    expected = np.clip((stress / (C_STRONG * 20.0)) ** (1.0 / N_STRONG), *BOUNDS)
    # Von Mises stress is averaged over the four points of a tetrahedron, exact where it is linear.
    np.testing.assert_allclose(found, expected, rtol=2e-6)
    assert np.ptp(found) > 0.4
    assert found.min() > BOUNDS[0]


def test_the_greatest_load_case_counts():
    """Pulled by a half and pushed by twice as much: the law asks for the push."""
    model, solid, _ = bar(tractions=(TRACTION, -2.0 * TRACTION))
    problem = problem_of(model)
    found = mapped_density(problem, solid_demand(problem, solid), 5.0)
    expected = (2.0 * TRACTION / (C_STRONG * 5.0)) ** (1.0 / N_STRONG)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_law_as_stated_decides():
    """One per cent of strength moves the density by 1.01^(-1/n), no more and no less."""
    found = []
    for c in (C_STRONG, 1.01 * C_STRONG):
        model, solid, _ = bar(law(c=c))
        problem = problem_of(model)
        found.append(mapped_density(problem, solid_demand(problem, solid), 5.0).mean())
    assert found[1] / found[0] == pytest.approx(1.01 ** (-1.0 / N_STRONG), rel=1e-6)
    assert found[1] / found[0] < 0.993


def test_densities_stay_within_the_bounds_of_their_place():
    model, solid, _ = bar()
    x = centroids(model.space.mesh)[0]
    low, high = np.where(x < 8.0, 0.3, 0.1), np.where(x < 8.0, 0.6, 0.2)
    problem = problem_of(model, windows=(low, high))
    found = mapped_density(problem, solid_demand(problem, solid), 5.0)
    by_law = (TRACTION / (C_STRONG * 5.0)) ** (1.0 / N_STRONG)
    assert 0.3 < by_law < 0.6
    np.testing.assert_allclose(found[x < 8.0], by_law, rtol=1e-6)
    np.testing.assert_allclose(found[x > 8.0], 0.2, rtol=1e-12)


def test_the_filter_averages_the_map():
    """Over the cells within its radius, by volume; a radius of nothing leaves the map as it is."""
    model, solid, _ = bar(tractions=(0.0,), acceleration=5e5)
    sharp, smooth = problem_of(model), problem_of(model, radius=6.0)
    stress = solid_demand(sharp, solid)
    a, b = mapped_density(sharp, stress, 20.0), mapped_density(smooth, stress, 20.0)
    np.testing.assert_allclose(b, filtered(smooth.filter, a), rtol=1e-12)
    assert np.ptp(b) < 0.9 * np.ptp(a)


# --- the factor -----------------------------------------------------------------------------------


@pytest.mark.parametrize("target", [1.0, 0.985])
def test_a_limit_of_stress_alone_leaves_the_density_of_the_law(target):
    """The stress of this bar does not depend on its densities: the factor is one over the aim."""
    model, solid, _ = bar()
    problem = problem_of(model, stress_limit(model, 5.0), target=target)
    sized = size_by_stress(problem, solid, 5.0)
    exact = (TRACTION / (C_STRONG * 5.0 * target)) ** (1.0 / N_STRONG)
    # Used to at least 1 - LEFT of its aim: the density is greater by that to the power 1/n at most.
    assert exact * (1 - 1e-5) <= sized.rho.mean() <= exact * (1 - LEFT) ** (-1.0 / N_STRONG)
    assert np.ptp(sized.rho) == pytest.approx(0.0, abs=1e-9)
    assert 1.0 / target * (1 - 1e-4) <= sized.variables[0] <= 1.0 / target / (1 - LEFT)
    assert sized.converged
    assert sized.feasible
    assert len(sized.history) <= 4


def test_a_limit_of_stiffness_scales_the_map():
    """u = sigma L / (E c rho^n) of a bar of one density, solved for it."""
    model, solid, nodes = bar()
    allowed = 0.05
    problem = problem_of(model, stress_limit(model, 5.0), tip_limit(nodes, allowed))
    sized = size_by_stress(problem, solid, 5.0)
    exact = (TRACTION * LENGTH / (1000.0 * C_STIFF * allowed)) ** (1.0 / N_STIFF)
    assert exact * (1 - 1e-5) <= sized.rho.mean() <= exact * (1 - LEFT) ** (-1.0 / N_STIFF)
    # By the law of strength that much more stress would need it.
    by_strength = C_STRONG * 5.0 * sized.rho.mean() ** N_STRONG / TRACTION
    assert sized.variables[0] == pytest.approx(by_strength, rel=1e-4)
    assert sized.history[-1].utilisations[0] < 0.9


def test_a_graded_bar_holds_its_displacement():
    """Under inertia: the tip by the integral of the strain of the map that was found."""
    model, solid, nodes = bar(tractions=(0.0,), acceleration=5e5)
    problem = problem_of(model, tip_limit(nodes, 0.2))
    sized = size_by_stress(problem, solid)
    assert sized.feasible
    assert sized.history[-1].utilisations[0] == pytest.approx(1.0 - LEFT / 2, abs=LEFT / 2 + 1e-6)
    factor = sized.variables[0]
    again = mapped_density(problem, solid_demand(problem, solid), largest_at_upper(model) / factor)
    np.testing.assert_allclose(sized.rho, again, rtol=1e-4)


def largest_at_upper(model):
    """Stress in the solid of the most stressed tetrahedron at the upper bound, MPa."""
    x = centroids(model.space.mesh)[0].min()
    stress = MATERIAL.density * 5e5 * (LENGTH - x)
    return stress / (C_STRONG * BOUNDS[1] ** N_STRONG)


def test_the_next_sizing_goes_on_from_the_factor():
    model, solid, nodes = bar()
    problem = problem_of(model, tip_limit(nodes, 0.05))
    first = size_by_stress(problem, solid, 5.0)
    again = size_by_stress(problem, solid, 5.0, start=float(first.variables[0]))
    assert len(again.history) == 2
    np.testing.assert_allclose(again.rho, first.rho, rtol=LEFT)


def test_a_law_that_is_softer_by_one_per_cent_needs_more():
    """Only the stiffness of the law: the density grows by 1.01^(1/n)."""
    densities = []
    for allowed in (0.05, 0.05 / 1.01):
        model, solid, nodes = bar()
        problem = problem_of(model, tip_limit(nodes, allowed))
        densities.append(size_by_stress(problem, solid, 5.0).rho.mean())
    ratio = 1.01 ** (1.0 / N_STIFF)
    assert densities[1] / densities[0] == pytest.approx(ratio, rel=LEFT / N_STIFF)


def test_what_no_density_holds_ends_at_the_upper_bound():
    model, solid, nodes = bar()
    problem = problem_of(model, tip_limit(nodes, 1e-4))
    sized = size_by_stress(problem, solid, 5.0)
    np.testing.assert_allclose(sized.rho, BOUNDS[1], rtol=1e-12)
    assert not sized.feasible


def test_what_every_density_holds_ends_at_the_lower_bound():
    model, solid, nodes = bar()
    sized = size_by_stress(problem_of(model, tip_limit(nodes, 1e3)), solid, 5.0)
    np.testing.assert_allclose(sized.rho, BOUNDS[0], rtol=1e-12)
    assert len(sized.history) == 1


def test_a_part_without_stress_has_nothing_to_map():
    model, solid, nodes = bar()
    still = [replace(one, displacement=0.0 * one.displacement) for one in solid]
    with pytest.raises(DensityError, match=r'no stress where lattice is.*method = "lightest"'):
        size_by_stress(problem_of(model, tip_limit(nodes, 0.05)), still, 5.0)


# --- the case -------------------------------------------------------------------------------------

CASE = """\
[case]
name = "bar"
[part]
box = ["16 mm", "8 mm", "8 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.3, 0.5]
method = "stress-to-density"
"""


def resolved(folder, text):
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return resolve_case(gradedesign.load_case(path), build_registry()).case


@pytest.mark.parametrize(
    ("more", "acceptance"),
    [
        ("", "whole"),
        ("[run]\nmax_iterations = 3\n", "whole"),
        ('[run]\nacceptance = "auto"\n', "auto"),
        ('[run]\nacceptance = "submodels"\n', "submodels"),
    ],
)
def test_the_surface_is_meshed_again_whole_unless_the_case_says_otherwise(
    tmp_path, more, acceptance
):
    assert resolved(tmp_path, CASE + more).run.acceptance == acceptance


def test_the_other_method_keeps_its_default(tmp_path):
    text = CASE.replace("stress-to-density", "lightest")
    assert resolved(tmp_path, text).run.acceptance == "auto"


def test_a_uniform_lattice_has_no_map(tmp_path):
    with pytest.raises(CaseError, match=r'case.toml:\d+: lattice.method: .*grading = "uniform"'):
        resolved(tmp_path, CASE + 'grading = "uniform"\n')


def test_a_law_without_strength_maps_no_stress(tmp_path):
    words = r"has no strength, and case.toml:22: lattice.method maps stress to density"
    with pytest.raises(CaseError, match=words):
        resolved(tmp_path, CASE + "law = {stiffness = {c = 0.5, n = 1.3}}\n")


def test_an_unknown_method_names_both(tmp_path):
    with pytest.raises(CaseError, match=r"lattice.method: .*lightest.*stress-to-density"):
        resolved(tmp_path, CASE.replace("stress-to-density", "stress_density"))
