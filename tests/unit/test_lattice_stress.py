"""Local stress of the homogenised lattice by strength surfaces: axes, uniaxial stress, sizing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.material.strength_surface import StrengthSurface
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity
from gradedesign.mechanics.sizing.filter import uniform_filter
from gradedesign.mechanics.sizing.homogenised import lattice_mass
from gradedesign.mechanics.sizing.homogenised_model import homogenised_model
from gradedesign.mechanics.sizing.lattice_stiffness import (
    as_stiffness,
    cell_stiffness,
    lattice_stiffness,
)
from gradedesign.mechanics.sizing.lattice_stress import (
    lattice_stress,
    least_density,
    local_stress_at,
    stress_demand,
)
from gradedesign.mechanics.sizing.size import SizingProblem, size
from gradedesign.mechanics.sizing.state import SolvedState

LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.4),
    strength=(0.4, 1.3),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none", poissons_ratio=0.0),
)
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6, yield_strength=10.0,
)  # fmt: skip
DENSITY = np.array([0.05, 0.1, 0.2, 0.4, 0.9])
ALONG_X = np.diag([1.0, 0, 0, 0, 0, 0])
IN_XY = np.diag([0, 0, 0, 0, 0, 1.0])


def with_surface(form, symmetry="none", exponent=2):
    """The test law with local stress sqrt(stress . form . stress) over its strength."""
    surfaces = tuple(
        StrengthSurface(
            exponent=exponent,
            weights=np.ones(1),
            forms=form[None] / float(LAW.strength(r)) ** 2,
            symmetry=symmetry,
            max_error=0.0,
            rms_error=0.0,
            unsafe_error=0.0,
            percentile=99.5,
        )
        for r in DENSITY
    )
    return replace(LAW, local_stress=LocalStressLaw(density=DENSITY, surfaces=surfaces))


def model_of(law, rotation=None, traction=(0.5, 0.0, 0.0)):
    mesh = box_part_mesh((8.0, 4.0, 4.0), 4.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 8 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array(traction)),
        acceleration=np.zeros(3),
    )
    return homogenised_model(
        space, np.zeros(space.element_count), MATERIAL, law, [case], rotation=rotation
    )


def strained(model, strain):
    """The displacement of a uniform strain, by its load case."""
    return {"load": strain @ model.space.nodes}


def local(model, strain, rho):
    densities = np.full(model.space.element_count, rho)
    stress = lattice_stress(model, densities, strained(model, strain))
    found = local_stress_at(model, stress[0], densities)
    np.testing.assert_allclose(found, found[0], rtol=1e-9)
    return float(found[0])


def test_uniaxial_stress_equals_the_uniaxial_strength():
    """Local stress is stress over strength, by the surface and by the power law."""
    strain = np.diag([0.01, 0.0, 0.0])
    expected = 1000 * 0.6 * 0.2**1.4 * 0.01 / (0.4 * 0.2**1.3)
    assert local(model_of(with_surface(ALONG_X)), strain, 0.2) == pytest.approx(expected, rel=1e-9)
    assert local(model_of(LAW), strain, 0.2) == pytest.approx(expected, rel=1e-9)


def test_stress_is_seen_in_the_axes_of_the_cell():
    """A cell that feels only its own x: tension at an angle a to it counts cos(a)^2 (Mohr)."""
    strain = np.diag([0.01, 0.0, 0.0])
    straight = local(model_of(with_surface(ALONG_X)), strain, 0.2)
    for angle in (20.0, -35.0, 70.0):
        turn = Rotation.from_euler("z", angle, degrees=True).as_matrix()
        turned = local(model_of(with_surface(ALONG_X), turn), strain, 0.2)
        assert turned / straight == pytest.approx(np.cos(np.radians(angle)) ** 2, rel=1e-9)
        # What it feels of shear in its x-y plane changes sign with the angle and does not here.
        sheared = local(model_of(with_surface(IN_XY), turn), strain, 0.2)
        half = abs(np.sin(np.radians(2 * angle))) / 2
        assert sheared / straight == pytest.approx(half, rel=1e-9)


def test_turning_cell_and_load_together_changes_nothing():
    rng = np.random.default_rng(77)
    a = rng.standard_normal((6, 6))
    law = with_surface(a @ a.T, symmetry="cubic", exponent=4)
    strain = rng.standard_normal((3, 3))
    strain = 0.01 * (strain + strain.T)
    straight = local(model_of(law), strain, 0.3)
    for _ in range(3):
        turn = Rotation.random(rng=rng).as_matrix()
        # The stiffness of the test law is isotropic, so the stress turns with the strain.
        turned = local(model_of(law, turn), turn @ strain @ turn.T, 0.3)
        assert turned == pytest.approx(straight, rel=1e-9)
        assert local(model_of(law, turn), strain, 0.3) != pytest.approx(straight, rel=1e-3)


def test_least_density_is_that_of_the_power_law_where_both_mean_the_same():
    strain = np.diag([0.01, 0.0, 0.0])
    found = []
    for law in (with_surface(ALONG_X), LAW):
        model = model_of(law)
        rho = np.full(model.space.element_count, 0.3)
        stiffness = as_stiffness(cell_stiffness(model, rho))
        stress = stress_demand(model, stiffness, strained(model, strain))[0]
        found.append(least_density(model, stress, 12.0))
        np.testing.assert_allclose(local_stress_at(model, stress, found[-1]), 12.0, rtol=1e-5)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5)


def stress_limit(count):
    return StressLimit(
        key=LimitKey(kind="stress", region="lattice"), name="stress in lattice", allowed=6.0,
        percentile=99.5, evaluated=np.ones(count, dtype=bool),
    )  # fmt: skip


def measured(limit, model, rho, cases):
    """The predicted value for given stresses, one load case each."""
    names = [f"case {k}" for k in range(len(cases))]
    loads = tuple(replace(model.cases[0], name=name) for name in names)
    state = SolvedState(
        model=replace(model, cases=loads), rho=rho, share=None,
            lattice_alone=model, displacements={},
        stress=dict(zip(names, cases, strict=True)),
    )  # fmt: skip
    return limit.predict(state).value


@pytest.mark.parametrize("weight", [1.0, 4.0])
def test_sizing_uses_the_surface(weight):
    """A bar under 0.5 MPa: strength(rho) = sqrt(weight) * 0.5 / limit gives its density."""
    model = model_of(with_surface(weight * ALONG_X))
    count = model.space.element_count
    limit = stress_limit(count)
    problem = SizingProblem(
        model=model, limits=(limit,), bounds=(0.06, 0.85),
        filter=uniform_filter(count),
    )  # fmt: skip
    result = size(problem, tolerance=2e-4)
    expected = (np.sqrt(weight) * 0.5 / 6.0 / 0.4) ** (1 / 1.3)
    assert result.feasible
    np.testing.assert_allclose(result.rho, expected, rtol=0.005)
    assert result.history[-1].utilisations[0] == pytest.approx(1.0, rel=0.005)


def test_the_measure_is_of_the_worst_load_case_and_carries_its_factor():
    model = model_of(with_surface(ALONG_X))
    count = model.space.element_count
    rho = np.full(count, 0.2)
    cases = [
        lattice_stress(model, rho, strained(model, f * np.diag([0.01, 0, 0])))[0] for f in (1, 3, 2)
    ]
    limit = replace(stress_limit(count), factor=1.1)
    one = local(model, np.diag([0.01, 0.0, 0.0]), 0.2)
    assert measured(limit, model, rho, cases) == pytest.approx(1.1 * 3 * one, rel=1e-9)


def test_a_percentile_over_cells_mixes_the_stress_inside_them():
    """Half of the volume stressed twice as much, tails of power a: ((1 + 2^a) / 2)^(1/a)."""
    power, stress = 5.0, np.linspace(0.5, 2.5, 9)
    spread = np.stack([100 - 0.5 * stress**-power, stress])
    plain = with_surface(ALONG_X)
    surfaces = tuple(replace(s, distribution=spread) for s in plain.local_stress.surfaces)
    law = replace(plain, local_stress=LocalStressLaw(density=DENSITY, surfaces=surfaces))
    model = model_of(law)
    rho = np.full(model.space.element_count, 0.2)
    limit = stress_limit(len(rho))
    one = local(model, np.diag([0.01, 0.0, 0.0]), 0.2)
    even = lattice_stress(model, rho, strained(model, np.diag([0.01, 0.0, 0.0])))[0]
    assert measured(limit, model, rho, [even]) == pytest.approx(one, rel=1e-7)
    half = np.cumsum(model.volumes) <= 0.5 * model.volumes.sum() * (1 + 1e-12)
    assert model.volumes[half].sum() == pytest.approx(0.5 * model.volumes.sum())
    uneven = [replace(even, demand=even.demand * np.where(half, 2.0, 1.0))]
    expected = one * ((1 + 2**power) / 2) ** (1 / power)
    assert measured(limit, model, rho, uneven) == pytest.approx(expected, rel=1e-7)
    # Another percentile than the surfaces' follows the same tail.
    other = replace(limit, percentile=99.0)
    assert measured(other, model, rho, [even]) == pytest.approx(one * 2 ** (-1 / power), rel=1e-7)
    # All of the volume: the largest of the plain numbers, as no tail of a distribution ends.
    whole = replace(limit, percentile=100.0)
    assert measured(whole, model, rho, uneven) == pytest.approx(2 * one, rel=1e-7)
    # Where nothing is known of the inside of a cell, the most stressed cells stand for themselves.
    assert measured(limit, model_of(plain), rho, uneven) == pytest.approx(2 * one, rel=1e-7)


def test_the_model_is_that_of_the_density_held():
    plain = model_of(with_surface(ALONG_X))
    count = plain.space.element_count
    held = np.array([0.1, 0.2, 0.4])[:, None] * np.full(count, 1.5)
    model = replace(
        plain, effective=EffectiveDensity(nominal=np.array([0.1, 0.2, 0.4]), effective=held)
    )
    asked, there = np.full(count, 0.2), np.full(count, 0.3)
    np.testing.assert_allclose(lattice_stiffness(model, asked), lattice_stiffness(plain, there))
    assert lattice_mass(model, asked) == pytest.approx(lattice_mass(plain, there))
    assert lattice_mass(plain, there) == pytest.approx(MATERIAL.density * 128 * 0.3)
    strain = np.diag([0.01, 0.0, 0.0])
    assert local(model, strain, 0.2) == pytest.approx(local(plain, strain, 0.3))
    # Beyond the window of the law stiffness and load are carried in proportion to the solid.
    dense = lattice_stiffness(model, np.full(count, 0.8))
    top = lattice_stiffness(plain, np.full(count, DENSITY[-1]))
    np.testing.assert_allclose(dense, top * 1.2 / DENSITY[-1])
    one = local(plain, strain, float(DENSITY[-1]))
    assert local(model, strain, 0.8) == pytest.approx(one)


def test_the_density_asked_for_is_less_where_more_is_held():
    plain = model_of(with_surface(ALONG_X))
    count = plain.space.element_count
    held = np.array([0.05, 0.9])[:, None] * np.full(count, 1.25)
    model = replace(
        plain, effective=EffectiveDensity(nominal=np.array([0.05, 0.9]), effective=held)
    )
    stress = lattice_stress(plain, np.full(count, 0.3), strained(plain, np.diag([0.01, 0.0, 0.0])))[
        0
    ]
    np.testing.assert_allclose(
        least_density(model, stress, 12.0), least_density(plain, stress, 12.0) / 1.25
    )
