"""Adjoint sensitivities of limited values against central differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.geometry.lattice.components.skin import Skin
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part_mesh import box_part_mesh
from gradedesign.geometry.tets.tet_mesh import boundary_facets
from gradedesign.mechanics.fe.facets import facet_nodes
from gradedesign.mechanics.fe.load_case import PartLoadCase
from gradedesign.mechanics.fe.loads import traction_force
from gradedesign.mechanics.fe.space import tet_space
from gradedesign.mechanics.fe.stress import weighted_percentile
from gradedesign.mechanics.fe.supports import supports_on
from gradedesign.mechanics.limits.cell_buckling import _NORM, WAVES, BucklingLimit
from gradedesign.mechanics.limits.clusters import CLUSTERS, clusters
from gradedesign.mechanics.limits.displacement import _NORM as _REGION_NORM
from gradedesign.mechanics.limits.displacement import DisplacementLimit
from gradedesign.mechanics.limits.frequency import FrequencyLimit
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.limits.member_stress import MemberStressLimit
from gradedesign.mechanics.limits.part_buckling import PartBucklingLimit
from gradedesign.mechanics.limits.volume_percentile import volume_percentile
from gradedesign.mechanics.material import long_waves
from gradedesign.mechanics.material.bond_matrix import bond_matrix
from gradedesign.mechanics.material.buckling_law import BucklingLaw
from gradedesign.mechanics.material.buckling_table import BucklingTable
from gradedesign.mechanics.material.law_field import SPREAD, LawField
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.material.strength_surface import StrengthSurface
from gradedesign.mechanics.sizing.effective_density import EffectiveDensity
from gradedesign.mechanics.sizing.homogenised import homogenised_system
from gradedesign.mechanics.sizing.homogenised_model import effective_density, homogenised_model
from gradedesign.mechanics.sizing.members import with_members, with_moments
from gradedesign.mechanics.sizing.responses import response_gradients, solve_adjoints
from gradedesign.mechanics.sizing.solid_moments import solid_fraction, solid_moments
from gradedesign.mechanics.sizing.state import solved_state

LAW = power_law(
    "test-law",
    ("test",),
    youngs=(0.6, 1.4),
    strength=(0.4, 1.3),
    window=(0.05, 0.9),
    origin=LawOrigin(kind="fe", source="this test", test="none"),
)
MATERIAL = Material(
    name="test", youngs_modulus=1000.0, poissons_ratio=0.3, density=1e-6,
    yield_strength=10.0, thermal_expansion=2e-5,
)  # fmt: skip


def _problem(acceleration, temperature, component, exponent=0.0, size=(20.0, 6.0, 5.0)):
    mesh = box_part_mesh(size, 3.0)
    space = tet_space(mesh, 2)
    facets, _ = boundary_facets(mesh)
    x = mesh.points[0][facets]
    root, tip = facets[(x < 1e-9).all(axis=1)], facets[(x > 20 - 1e-9).all(axis=1)]
    case = PartLoadCase(
        name="load",
        supports=supports_on(space, [(root, (0.0, 0.0, 0.0))]),
        force=traction_force(space, tip, np.array([0.01, 0.0, -0.02])),
        acceleration=acceleration,
        temperature_change=temperature,
    )
    rng = np.random.default_rng(60713)
    share = np.where(rng.uniform(size=space.element_count) < 0.2, 0.4, 0.0)
    model = homogenised_model(space, share, MATERIAL, LAW, [case])
    if exponent:
        model = replace(
            model, stiffness_factor=0.8, stiffness_exponent=exponent, reference_density=0.3
        )
    limit = DisplacementLimit(
        key=LimitKey(kind="displacement", region="tip", load_case="load"), name="tip",
        nodes=np.unique(facet_nodes(space, tip))[:1], component=component, allowed=1.0, factor=1.1,
    )  # fmt: skip
    return model, limit, rng.uniform(0.2, 0.5, space.element_count), rng


def solved(model, limit, rho, share=None, system=None):
    whole = with_members(model, share)
    return solved_state(whole, rho, [limit], system, share=share, lattice_alone=model)


def gradient_of(model, limit, rho, share=None):
    system = homogenised_system(with_members(model, share), rho)
    state = solved(model, limit, rho, share, system)
    responses = limit.responses(state)
    adjoints = solve_adjoints(model, system, responses)
    return response_gradients(state, responses, adjoints)[0]


def predicted(limit, state):
    return limit.predict(state).value


def assert_slope(model, limit, rho, rng, step=1e-5, rel=1e-5, value=predicted):
    """The gradient in a random direction is the difference quotient, itself good to about 1e-6.

    With densities alone, and with solid members of any share.
    """
    direction = rng.standard_normal(len(rho))
    ahead, back = (value(limit, solved(model, limit, rho + s * step * direction)) for s in (1, -1))
    found = gradient_of(model, limit, rho) @ direction
    assert found == pytest.approx((ahead - back) / (2 * step), rel=rel)
    model = with_moments(model)
    share, turn = rng.uniform(0.0, 0.95, 4 * len(rho)), rng.standard_normal(4 * len(rho))
    ahead, back = (
        value(limit, solved(model, limit, rho + s * step * direction, share + s * step * turn))
        for s in (1, -1)
    )
    found = gradient_of(model, limit, rho, share) @ np.concatenate([direction, turn])
    assert found == pytest.approx((ahead - back) / (2 * step), rel=rel)


@pytest.mark.parametrize(
    ("acceleration", "temperature", "component", "exponent"),
    [
        ((0.0, 0.0, 0.0), 0.0, None, 0.0),
        ((0.0, 0.0, 0.0), 0.0, 2, 0.7),
        ((0.0, 0.0, -2e4), 0.0, None, 0.0),
        ((0.0, 0.0, 0.0), 80.0, 0, 0.0),
    ],
    ids=["magnitude", "component, corrected law", "inertia", "thermal"],
)
def test_gradient_matches_central_differences(acceleration, temperature, component, exponent):
    model, limit, rho, rng = _problem(acceleration, temperature, component, exponent)
    assert_slope(model, limit, rho, rng)


@pytest.mark.parametrize("kept", [False, True], ids=["no solid", "two kept solids"])
@pytest.mark.parametrize("component", [None, 2], ids=["magnitude", "component"])
def test_gradient_of_every_cluster_of_a_region_matches_central_differences(component, kept):
    """Each is that of the norm of its nodes, in proportion to their largest displacement."""
    model, limit, rho, rng = _problem((0.0, 0.0, 0.0), 0.0, component)
    tip = np.flatnonzero(model.space.nodes[0] > 20 - 1e-9)
    halves = np.where(model.space.nodes[1, tip] < 3.0, 4, 9)
    limit = replace(limit, nodes=tip, solids=halves if kept else None)
    parts = [tip[mine] for mine in clusters(model.space.nodes[:, tip], CLUSTERS)]
    if kept:
        parts = [tip[halves == number] for number in (4, 9)]
    direction = 1e-5 * rng.standard_normal(rho.size)

    def sizes(state, nodes):
        u = state.displacement("load")[:, nodes]
        return np.linalg.norm(u, axis=0) if component is None else np.abs(u[component])

    states = [solved(model, limit, rho + s * direction) for s in (-1, 0, 1)]
    system = homogenised_system(model, rho)
    responses = limit.responses(states[1])
    gradients = response_gradients(states[1], responses, solve_adjoints(model, system, responses))
    expected = {}
    for nodes in parts:
        back, here, ahead = (
            (sizes(state, nodes) ** _REGION_NORM).sum() ** (1 / _REGION_NORM) for state in states
        )
        largest = limit.factor * sizes(states[1], nodes).max()
        expected[largest] = largest * (ahead - back) / (2 * here)
    assert len(responses) == 2 if kept else len(responses) > 4
    for response, gradient in zip(responses, gradients, strict=True):
        nearest = min(expected, key=lambda value: abs(value - response.value))
        assert response.value == pytest.approx(nearest, rel=1e-12)
        assert gradient @ direction == pytest.approx(expected[nearest], rel=1e-5)


@pytest.mark.parametrize(("number", "exponent"), [(1, 0.0), (2, 0.7), (3, 0.0)])
def test_gradient_of_a_frequency_matches_central_differences(number, exponent):
    model, _, rho, rng = _problem((0.0, 0.0, 0.0), 0.0, None, exponent)
    limit = FrequencyLimit(
        key=LimitKey(kind="frequency", component=f"mode {number}", load_case="load"),
        name="frequency", allowed=40.0, factor=1.1, number=number,
    )  # fmt: skip
    assert_slope(model, limit, rho, rng, rel=1e-5)


PART_BUCKLING = PartBucklingLimit(
    key=LimitKey(kind="part_buckling", load_case="load"), name="buckling of the part",
    allowed=2.0, factor=1.1,
)  # fmt: skip


def smoothed(limit, state):
    (response,) = limit.responses(state)
    return response.value


@pytest.mark.parametrize(
    ("acceleration", "temperature", "exponent"),
    [
        ((0.0, 0.0, 0.0), 0.0, 0.0),
        ((-2e5, 0.0, -2e4), 0.0, 0.7),
        ((0.0, 0.0, 0.0), 80.0, 0.0),
    ],
    ids=["force", "inertia, corrected law", "thermal"],
)
def test_gradient_of_the_load_factor_matches_central_differences(
    acceleration, temperature, exponent
):
    model, _, rho, rng = _problem(acceleration, temperature, None, exponent)
    assert_slope(model, PART_BUCKLING, rho, rng, value=smoothed)
    # Single factors are what they are.
    state = solved(model, PART_BUCKLING, rho)
    assert smoothed(PART_BUCKLING, state) == pytest.approx(
        predicted(PART_BUCKLING, state), rel=1e-3
    )


def test_gradient_of_the_load_factor_where_two_are_equal():
    """A square column of equal densities, whose two modes the direction tells apart."""
    model, _, rho, rng = _problem((-1e7, 0.0, 0.0), 0.0, None, size=(24.0, 5.0, 5.0))
    case = replace(model.cases[0], force=np.zeros(model.space.nodes.shape))
    model = replace(model, cases=(case,), solid_fraction=np.zeros(rho.size))
    alike = np.full(rho.size, 0.3)
    factors = solved(model, PART_BUCKLING, alike).load_factors("load").values
    assert factors[1] == pytest.approx(factors[0], rel=5e-3)
    assert factors[2] > 3.0 * factors[0]
    assert_slope(model, PART_BUCKLING, alike, rng, value=smoothed)


@pytest.mark.parametrize("turns", [False, True], ids=["straight", "turned"])
def test_gradient_of_the_load_factor_where_a_skin_lies_at_a_face(turns):
    model, _, rho, rng = _problem((0.0, 0.0, 0.0), 80.0, None)
    model = skinned(model)
    model = turned(model, rng) if turns else model
    assert_slope(model, PART_BUCKLING, rho, rng, value=smoothed)


SHORT_WAVES = BucklingLaw(
    table=BucklingTable(
        density=np.array([0.1, 0.3]),
        critical=np.array([0.002, 0.011])[:, None, None] * [[1.0, 6.0]] * np.ones((6, 1)),
        cells=np.full((2, 6, 2), 2), error=np.full(2, 0.01), resolution=np.full(2, 40),
        wall_voxels=np.full(2, 3.0), poissons_ratio=0.3, method="none", version="0", date="none",
    )
)  # fmt: skip


@pytest.mark.parametrize("temperature", [0.0, 80.0], ids=["force", "thermal"])
@pytest.mark.parametrize("waves", ["short", "long", "mix", "turned", "trimmed"])
def test_gradient_of_cell_buckling_matches_central_differences(waves, temperature, monkeypatch):
    # Differences see how far the search for the wave goes.
    monkeypatch.setattr(long_waves, "_LAST_STEP", 1e-6)
    model, _, rho, rng = _problem((0.0, 0.0, 0.0), temperature, None)
    law = LAW if waves == "long" else replace(LAW, buckling=SHORT_WAVES)
    # Uses that are near their limit: small ones are bounded, not searched.
    case = replace(model.cases[0], force=200.0 * model.cases[0].force)
    model = replace(model, law=LawField(laws=(law,)), cases=(case,))
    if waves == "turned":
        model = turned(model, rng)
        (law,) = model.law.laws
        model = replace(model, law=LawField(laws=(replace(law, buckling=SHORT_WAVES),)))
    elif waves == "mix":
        weak = replace(SHORT_WAVES, table=replace(SHORT_WAVES.table, density=np.array([0.2, 0.4])))
        share = rng.uniform(0.2, 0.8, rho.size)
        mixed = LawField(
            laws=(law, replace(law, buckling=weak)), weights=np.array([share, 1.0 - share]),
            stiffness_factor=np.full(rho.size, 0.8), strength_factor=np.ones(rho.size),
        )  # fmt: skip
        model = replace(model, law=mixed)
    elif waves == "trimmed":
        held = rng.uniform(0.7, 1.2, (2, rho.size)) * np.array([[0.1], [0.6]])
        model = replace(
            model, effective=EffectiveDensity(nominal=np.array([0.1, 0.6]), effective=held),
            cut_share=rng.uniform(0.5, 1.0, rho.size),
        )  # fmt: skip
    limit = BucklingLimit(
        key=LimitKey(kind="buckling"), name="buckling of cells", allowed=0.5, law=model.law
    )

    def norm(state):
        use = limit.law.buckling(state.buckling_profile("load"), state.effective_density)
        use = np.where(state.lattice_volumes > 0, use, 0.0)
        return float((use**_NORM).sum() ** (1.0 / _NORM))

    state = solved(model, limit, rho)
    assert limit.predict(state).governs == WAVES[waves == "long"]
    direction = rng.standard_normal(rho.size)
    ahead, back = (norm(solved(model, limit, rho + s * 1e-6 * direction)) for s in (1, -1))
    # Steps are short, since uses have kinks. In proportion to the norm, and the largest use here.
    expected = predicted(limit, state) * (ahead - back) / (2e-6 * norm(state))
    assert gradient_of(model, limit, rho) @ direction == pytest.approx(expected, rel=1e-5)


def turned(model, rng):
    """The model with a law that is not isotropic and axes of their own at every point."""
    stiff = np.diag([3.0, 1.0, 0.5, 0.3, 0.2, 0.1]) + 0.1
    law = replace(
        LAW,
        stiffness=lambda r: stiff[:, :, None] * r**2,
        stiffness_derivative=lambda r: 2 * stiff[:, :, None] * r,
    )
    turns = Rotation.random(4 * model.volumes.size, rng=rng).as_matrix()
    axes = bond_matrix(turns.transpose(1, 2, 0).reshape(3, 3, 4, -1))
    return replace(model, law=LawField(laws=(law,)), rotation=axes)


def skinned(model):
    """The model with a skin at a face, which takes a share of its tetrahedra."""
    skin = Skin(thickness=0.7, faces=lambda x: x[2])
    upper = (20.0, 6.0, 5.0)
    domain = DesignDomain(
        distance=lambda x: -x[2], lower=(0, 0, 0), upper=upper, components=(skin,)
    )
    moments = solid_moments(domain, model.space.mesh)
    return replace(model, solid_fraction=solid_fraction(moments), solid_moments=moments)


@pytest.mark.parametrize("temperature", [0.0, 80.0], ids=["force", "thermal"])
def test_gradient_where_cells_turn_inside_elements(temperature):
    model, limit, rho, rng = _problem((0.0, 0.0, 0.0), temperature, None)
    assert_slope(turned(model, rng), limit, rho, rng)


@pytest.mark.parametrize("turns", [False, True], ids=["straight", "turned"])
@pytest.mark.parametrize("temperature", [0.0, 80.0], ids=["force", "thermal"])
def test_gradient_where_a_skin_lies_at_a_face(temperature, turns):
    model, limit, rho, rng = _problem((0.0, 0.0, 0.0), temperature, None)
    model = skinned(model)
    # The random direction changes little here: solves of 1e-10 leave 1e-5 of a shorter step.
    assert_slope(turned(model, rng) if turns else model, limit, rho, rng, step=1e-4)


def test_gradient_follows_what_trimmed_cells_hold():
    """As above, with densities held that differ from those asked for, also beyond the window."""
    model, limit, rho, rng = _problem((0.0, 0.0, -2e4), 0.0, None, 0.4)
    asked = np.array([0.1, 0.3, 0.6])
    held = asked[:, None] ** rng.uniform(0.5, 1.1, len(rho)) * rng.uniform(0.6, 1.5, len(rho))
    model = replace(model, effective=EffectiveDensity(nominal=asked, effective=held))
    assert effective_density(model, rho).max() > LAW.window[1]
    # Not where the density held has a kink.
    rho = np.where(np.abs(rho - 0.3) < 0.01, 0.32, rho)
    assert_slope(model, limit, rho, rng)


def test_one_element_at_a_time():
    """Three elements that carry load, against central differences."""
    model, limit, rho, _ = _problem((0.0, 0.0, 0.0), 0.0, None)
    gradient = gradient_of(model, limit, rho)
    for e in np.argsort(gradient)[:3]:
        values = []
        for sign in (1, -1):
            changed = rho.copy()
            changed[e] += sign * 1e-3
            values.append(limit.predict(solved_state(model, changed, [limit])).value)
        assert gradient[e] == pytest.approx((values[0] - values[1]) / 2e-3, rel=1e-3)


#: Percentages of a cell's solid, and the local stress there over that of the percentile.
DISTRIBUTION = np.array([[20.0, 60.0, 90.0, 99.5], [0.15, 0.4, 0.7, 1.0]])


def surface(rng, scale, symmetry):
    """A norm of stress from random forms, the larger the thinner the cell."""
    roots = rng.normal(size=(3, 6, 6))
    forms = scale**2 * (roots @ roots.transpose(0, 2, 1) + 2.0 * np.eye(6))
    return StrengthSurface(
        exponent=8, weights=rng.uniform(0.5, 1.0, 3), forms=forms, symmetry=symmetry,
        max_error=0.0, rms_error=0.0, unsafe_error=0.0, percentile=99.5,
        distribution=DISTRIBUTION * [[1.0], [rng.uniform(0.95, 1.0)]],
    )  # fmt: skip


def stressed_law(rng, symmetry="orthotropic"):
    rho = np.array([0.05, 0.2, 0.4, 0.6, 0.9])
    surfaces = tuple(surface(rng, 1.0 / r, symmetry) for r in rho)
    return replace(LAW, local_stress=LocalStressLaw(density=rho, surfaces=surfaces))


def stress_problem(law=None, temperature=0.0, percentile=99.0):
    model, _, rho, rng = _problem((0.0, 0.0, -2e4), temperature, None, 0.4)
    if law is not None:
        model = replace(model, law=LawField(laws=(law(rng),)))
    limit = StressLimit(
        key=LimitKey(kind="stress", region="lattice"), name="stress", allowed=1.0, factor=1.2,
        percentile=percentile, evaluated=rng.uniform(size=rho.size) < 0.8,
    )  # fmt: skip
    return model, limit, rho, rng


def test_percentile_of_plain_numbers_grows_with_all_of_them():
    """Of degree one in the stresses, of degree none in the volumes: Euler's theorem."""
    model, _, rho, rng = stress_problem()
    local, volumes = rng.uniform(1.0, 3.0, rho.size), model.lattice_volumes
    found = volume_percentile(local, rho, volumes, model.law, 95.0)
    assert found.value == weighted_percentile(local, volumes * rho, 95.0)
    assert found.by_local @ local == pytest.approx(found.value, rel=1e-9)
    assert found.by_density @ rho == pytest.approx(0.0, abs=1e-9 * found.value)
    # The elements about the percentile carry the derivative.
    near = np.abs(np.log(local / found.value)) < 5 * SPREAD
    assert found.by_local[near] @ local[near] > 0.9 * found.value


@pytest.mark.parametrize("percentile", [60.0, 99.0])
@pytest.mark.parametrize("symmetry", ["cubic", "none"])
def test_percentile_of_strength_surfaces(symmetry, percentile):
    model, limit, rho, rng = stress_problem(
        lambda rng: stressed_law(rng, symmetry), 80.0, percentile
    )
    assert_slope(model, limit, rho, rng)


@pytest.mark.parametrize("everywhere", [False, True], ids=["one axis", "at every point"])
def test_percentile_where_cells_are_turned(everywhere):
    model, limit, rho, rng = stress_problem(stressed_law)
    turns = Rotation.random(4 * rho.size if everywhere else 1, rng=rng).as_matrix()
    axes = turns.transpose(1, 2, 0).reshape(3, 3, 4, -1) if everywhere else turns[0]
    assert_slope(replace(model, rotation=bond_matrix(axes)), limit, rho, rng)


def test_percentile_of_trimmed_cells():
    model, limit, rho, rng = stress_problem(stressed_law)
    asked = np.array([0.1, 0.3, 0.6])
    held = asked[:, None] ** rng.uniform(0.5, 1.1, rho.size) * rng.uniform(0.6, 1.5, rho.size)
    model = replace(model, effective=EffectiveDensity(nominal=asked, effective=held))
    rho = np.where(np.abs(rho - 0.3) < 0.01, 0.32, rho)
    # A short step: the few percentages of the distribution make kinks.
    assert_slope(model, limit, rho, rng, step=1e-5)


def test_percentile_of_a_mix():
    model, limit, rho, rng = stress_problem(stressed_law)
    laws = (*model.law.laws, replace(stressed_law(rng), name="other"), replace(LAW, name="third"))
    weights = rng.uniform(size=(3, rho.size))
    field = LawField(
        laws=laws, weights=weights / weights.sum(axis=0),
        stiffness_factor=rng.uniform(0.7, 1.0, rho.size),
        strength_factor=rng.uniform(0.7, 1.0, rho.size),
    )  # fmt: skip
    assert_slope(replace(model, law=field), limit, rho, rng, step=1e-5)


def test_percentile_of_solid_members():
    model, limit, rho, rng = stress_problem(stressed_law, 80.0)
    of_members = MemberStressLimit(
        key=limit.key, name="stress", allowed=1.0, factor=1.2, percentile=95.0,
        evaluated=limit.evaluated,
    )  # fmt: skip
    model = with_moments(model)
    share, turn = rng.uniform(0.1, 0.95, 4 * rho.size), rng.standard_normal(4 * rho.size)
    direction = rng.standard_normal(rho.size)
    state = solved(model, of_members, rho, share)
    # Where every share has its spread, a percentile of plain numbers jumps: its smooth one does not
    local, weights = state.solid_stress("load"), state.member_volumes * limit.evaluated
    smooth = [
        _smooth_percentile(solved(model, of_members, rho + s * direction, share + s * turn), limit)
        for s in (1e-5, -1e-5)
    ]
    found = gradient_of(model, of_members, rho, share) @ np.concatenate([direction, turn])
    value = of_members.predict(state).value
    assert value == pytest.approx(1.2 * weighted_percentile(local, weights, 95.0))
    scale = value / _smooth_percentile(state, limit)
    assert found == pytest.approx(scale * (smooth[0] - smooth[1]) / 2e-5, rel=1e-4)
    assert of_members.predict(solved(model, of_members, rho)).value == 0.0


def _smooth_percentile(state, limit):
    """Root of the smooth distribution that the derivatives are of, by bisection."""
    local, weights = state.solid_stress("load"), state.member_volumes * limit.evaluated
    low, high = local.min() / 2, local.max() * 2
    for _ in range(200):
        middle = np.sqrt(low * high)
        above = 1 / (1 + 0.95 / 0.05 * (middle / local) ** (1 / SPREAD))
        low, high = (middle, high) if weights @ above > 0.05 * weights.sum() else (low, middle)
    return middle
