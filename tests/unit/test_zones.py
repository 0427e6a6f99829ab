"""Zones of a part: weights by place, one field, one law, densities within each zone's bounds.

Cells are closed forms of few lines with written laws; installed ones go through cases/two-zones.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import label
from scipy.sparse import csr_matrix
from small_parts import box_part, held_bar

from gradedesign.design.case.read_case import load_case
from gradedesign.design.loop.designed import density_grid, with_design
from gradedesign.design.loop.iteration_steps import (
    SizingPlan,
    build_design,
    design_filter,
    explicit_spacing,
    size_design,
)
from gradedesign.design.resolve.design_model import prepare
from gradedesign.design.resolve.zoning import zone_windows
from gradedesign.design.verdict.common import zone_data, zone_measures
from gradedesign.errors import CaseError, DensityError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import spread_points
from gradedesign.geometry.lattice.component import MEMBER
from gradedesign.geometry.lattice.density_grid import evaluate
from gradedesign.geometry.lattice.domain import phase_at
from gradedesign.geometry.lattice.lattice import cell_field, density_at
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.homogenise import mix_factors as factors_module
from gradedesign.mechanics.material.law_field import LawField
from gradedesign.mechanics.material.power_law import power_law
from gradedesign.mechanics.material.scaling_law import LawOrigin
from gradedesign.mechanics.sizing.filter import DensityFilter
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    density_slope,
    element_densities,
)
from gradedesign.program.host.registry import build_registry


def waves(u):
    return np.cos(2 * np.pi * u).sum(axis=0)


def spirals(u):
    x, y, z = 2 * np.pi * u
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def sheet(name, f):
    return CellFamily(name=name, shape=lambda u: np.abs(f(u)), sides=2, signed=f)


P, G = sheet("waves", waves), sheet("spirals", spirals)
LEANING = CellFamily(
    name="leaning",
    shape=lambda u, lean: spirals(u) + lean * np.cos(2 * np.pi * u[2]),
    parameters={"lean": 0.0},
)
CASE = (
    held_bar(box_part(32, 8, 8, 4), material='name = "Ti-6Al-4V"', force="0 N, 0 N, -40 N")
    + """\
[limits]
displacement = [{region = "tip", magnitude = "0.2 mm"}]
[lattice]
cell = "spirals"
size = "8 mm"
density = [0.3, 0.6]
phases = ["lattice"]
[run]
elements_per_wall = 1.5
"""
)
HALF = '[[zone]]\nname = "root"\nformula = "x - 16"\ntransition = "8 mm"\n'
WAVES = HALF + 'cell = "waves"\n'


def written(family, youngs, window=(0.05, 0.9)):
    return power_law(
        f"{family}-law", (family,), youngs=youngs, strength=(0.5, 1.2), window=window,
        origin=LawOrigin(kind="fe", source="this test", test="none"),
    )  # fmt: skip


LAWS = {
    "waves": written("waves", (0.5, 1.5)),
    "spirals": written("spirals", (0.6, 1.5)),
    "leaning": written("leaning", (0.4, 1.5)),
}


@pytest.fixture(scope="module")
def registry():
    known = build_registry()
    return replace(
        known,
        cell_families={**known.cell_families, "waves": P, "spirals": G, "leaning": LEANING},
        scaling_laws={**known.scaling_laws, **{law.name: law for law in LAWS.values()}},
    )


@pytest.fixture
def two_thirds(monkeypatch):
    """Half and half two thirds as stiff as the mean of both cells, instead of computing mixes."""

    def mixed(cell, rho, *_):
        first, second = (
            LAWS[name].stiffness(np.array([rho]))[:, :, 0]
            for name in cell.name.rpartition("-")[0].split("-to-")
        )
        share = float(cell.name.rpartition("-")[2]) / 100
        return ((1 - share) * first + share * second) / 1.5, 0.4 * rho**1.2

    monkeypatch.setattr(factors_module, "_mix", mixed)
    monkeypatch.setattr(factors_module, "SHARES", (0.5,))


def prepared(folder, registry, text):
    (folder / "case.toml").write_text(CASE + text, encoding="utf-8")
    return prepare(load_case(folder), registry)


@pytest.mark.parametrize(
    "place",
    [
        'formula = "x - 16"',
        'formula = "5 * (x - 16)"',
        'box = {lower = ["-50 mm", "-50 mm", "-50 mm"], upper = ["16 mm", "60 mm", "60 mm"]}',
        'region = "root"\nwithin = "16 mm"',
        'cylinder = {point = ["-84 mm", "4 mm", "4 mm"], axis = "+z", diameter = "200 mm"}',
    ],
)
def test_weights_rise_over_the_transition(tmp_path, registry, place):
    text = f'[[zone]]\n{place}\ndensity = [0.4, 0.5]\ntransition = "8 mm"\n'
    weights = prepared(tmp_path, registry, text).cells.zoning.weights
    x = np.array([2.0, 12.0, 14.0, 16.0, 18.0, 20.0, 31.0])
    values = weights(np.stack([x, np.full(7, 4.0), np.full(7, 4.0)]))
    s = np.array([1, 1, 0.75, 0.5, 0.25, 0, 0])
    np.testing.assert_allclose(values[1], s**2 * (3 - 2 * s), atol=1e-6)
    np.testing.assert_allclose(values.sum(axis=0), 1)


def test_the_field_is_that_of_each_cell_outside_the_transition(tmp_path, registry, two_thirds):
    setup = prepared(tmp_path, registry, WAVES)
    rho = np.full(setup.homogenised.space.element_count, 0.4)
    grid = density_grid(setup, rho)
    both = build_design(setup.plan.domain, setup.cells, grid)
    points = np.array([[32.0], [8.0], [8.0]]) * spread_points(60_000)
    solid = cell_field(both)(points) <= 0
    u = both.cell_map(points)
    # Beside the transition, whose mixes have other bounds, the density is 0.4 within smoothing.
    wanted = density_at(both, points)
    assert np.abs(wanted[np.abs(points[0] - 16) > 6] - 0.4).max() < 1e-3
    for cell, there in ((P, points[0] < 12), (G, points[0] > 20)):
        density = calibrate(cell).density_of(cell.shape(u[:, there]))
        np.testing.assert_array_equal(solid[there], density <= wanted[there])
        # 22,500 points that fill one and a half cells evenly.
        assert solid[there].mean() == pytest.approx(0.4, abs=0.01)
    middle = np.abs(points[0] - 16) < 4
    assert solid[middle].mean() == pytest.approx(0.4, abs=0.02)


def test_the_solid_is_one_piece_across_the_border(tmp_path, registry, two_thirds):
    setup = prepared(tmp_path, registry, WAVES)
    rho = np.full(setup.homogenised.space.element_count, 0.3)
    design = build_design(setup.plan.domain, setup.cells, density_grid(setup, rho))
    axes = [np.arange(0.125, end, 0.25) for end in (32.0, 8.0, 8.0)]
    solid = cell_field(design)(np.stack(np.meshgrid(*axes, indexing="ij"))) <= 0
    pieces = np.sort(np.bincount(label(solid)[0].ravel())[1:])[::-1]
    assert pieces[1:].sum() < 0.005 * pieces[0]
    # No plane across the transition is a bottleneck: 0.3 on the mean of a cell.
    assert solid[48:80].mean(axis=(1, 2)).min() > 0.12


def test_elements_have_the_laws_of_their_zones(tmp_path, registry, two_thirds):
    setup = prepared(tmp_path, registry, WAVES)
    law = setup.homogenised.law
    x = centroids(setup.homogenised.space.mesh)[0]
    rho = np.full(x.size, 0.4)
    C = law.stiffness(rho)
    ends = {n: LAWS[n].stiffness(np.array([0.4]))[:, :, 0] for n in ("waves", "spirals")}
    for name, there in (("waves", x < 12), ("spirals", x > 20)):
        np.testing.assert_allclose(C[:, :, there], ends[name][:, :, None].repeat(there.sum(), 2))
    between = (x > 12) & (x < 20)
    assert between.any()
    mean = np.tensordot(
        np.stack([ends["spirals"], ends["waves"]], axis=-1), law.weights[:, between], axes=1
    )
    ratio = C[0, 0, between] / mean[0, 0]
    share = law.weights[1, between]
    # Two thirds half and half, linear to 1 at both ends.
    np.testing.assert_allclose(ratio, np.interp(share, [0, 0.5, 1], [1, 2 / 3, 1]))
    step = 1e-6
    slope = (law.stiffness(rho + step) - law.stiffness(rho - step)) / (2 * step)
    np.testing.assert_allclose(law.stiffness_derivative(rho), slope, rtol=1e-6, atol=1e-9)
    profile = law.stress_profile(None, np.full((x.size, 4), 10.0))
    local = law.local_stress(profile, rho)
    assert local[x < 12] == pytest.approx(10.0 / float(LAWS["waves"].strength(np.array(0.4))))
    # Written strengths are 0.5 rho^1.2, that of the mixes 0.4 rho^1.2.
    assert (local[between] > local[x < 12].max()).all()
    enough = law.density_for_stress(profile, 100.0)
    assert (law.local_stress(profile, enough) <= 100.0 * (1 + 1e-6)).all()


def test_zones_of_one_cell_are_no_zones(tmp_path, registry):
    plain = prepared(tmp_path, registry, "")
    same = prepared(tmp_path, registry, HALF + 'cell = "spirals"\n')
    assert same.cells.bounds == plain.cells.bounds
    assert len(same.cells.zoning.cells.members) == 1
    assert same.cells.zoning.windows is None
    results = [
        size_design(s, Correction(), {}, design_filter(s), SizingPlan(most_iterations=8))
        for s in (plain, same)
    ]
    np.testing.assert_allclose(results[1].rho, results[0].rho, rtol=1e-9)
    grids = [density_grid(s, results[0].rho) for s in (plain, same)]
    np.testing.assert_array_equal(grids[0].values, grids[1].values)
    spacings = [explicit_spacing(s, grids[0]) for s in (plain, same)]
    assert spacings[0] == spacings[1]


def test_densities_keep_the_bounds_of_their_zone(tmp_path, registry, two_thirds):
    text = WAVES + "density = [0.40, 0.45]\n"
    setup = prepared(tmp_path, registry, text)
    sized = size_design(
        setup, Correction(), {}, design_filter(setup), SizingPlan(most_iterations=8)
    )
    x = centroids(setup.homogenised.space.mesh)[0]
    for there, (low, high) in ((x < 12, (0.40, 0.45)), (x > 20, (0.3, 0.6))):
        assert sized.rho[there].min() >= low - 1e-12
        assert sized.rho[there].max() <= high + 1e-12
    # The clamped half is filled up before the free one.
    assert sized.rho[x < 8].mean() > sized.rho[x > 24].mean()
    grid = density_grid(setup, sized.rho)
    points = setup.cells.layout.points
    low, high = zone_windows(setup.cells.zoning, points)
    density = evaluate(grid, points)
    assert (density >= low - 1e-6).all()
    assert (density <= high + 1e-6).all()
    found = zone_measures(setup.homogenised, setup.cells.zoning, sized.rho)["zones"]
    assert found["root"]["share_of_lattice"] == pytest.approx(0.5, abs=0.02)
    assert sum(z["mass_g"] for z in found.values()) == pytest.approx(
        sized.history[-1].mass_g, rel=1e-9
    )
    data = zone_data(setup.cells.zoning)
    assert data["zones"]["root"]["density_bounds"] == [0.40, 0.45]
    assert data["transitions"][0]["cells"] == ["spirals", "waves"]


def test_a_zone_keeps_solid_members_out(tmp_path, registry):
    def member_phase(zone):
        text = CASE.replace('phases = ["lattice"]', 'least_member = "3 mm"') + zone
        text = text.replace('mesh_size = "4 mm"', 'mesh_size = "2 mm"')
        text = text.replace("0.2 mm", "0.06 mm")
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        model = prepare(load_case(tmp_path), registry)
        sized = size_design(model, Correction(), {}, design_filter(model), SizingPlan())
        made = with_design(model, sized.rho, sized.members)
        assert sized.feasible
        points = spread_points(20_000) * np.array([[32.0], [8.0], [8.0]])
        member = phase_at(made.plan.domain, points) == MEMBER
        held = made.homogenised.member_fraction
        assert made.homogenised.volumes @ held / 2048.0 == pytest.approx(member.mean(), abs=0.01)
        return points[0], member

    root = '[[zone]]\nname = "root"\nformula = "x - 8"\ntransition = "4 mm"\n'
    x, member = member_phase("")
    assert member[x < 7.9].mean() > 0.05
    x, member = member_phase(root + 'phases = ["lattice"]\n')
    assert not member[x < 7.9].any()
    assert member[x > 8].mean() > 0.02
    # A later zone lets them in again.
    again = '[[zone]]\nname = "all"\nformula = "x * 0 - 1"\nphases = ["lattice"]\n' + root
    x, member = member_phase(again + 'phases = ["lattice", "solid"]\n')
    assert member[x < 7.9].mean() > 0.05
    assert not member[x > 8.1].any()


def test_a_fixed_density_stays():
    low, high = np.array([0.4, 0.2, 0.1]), np.array([0.4, 0.5, 0.7])
    problem = SizingProblem(
        model=None,
        limits=(),
        bounds=(0.1, 0.7),
        filter=DensityFilter(factors=(csr_matrix(np.eye(3)),)),
        windows=(low, high),
    )
    rho = element_densities(problem, np.array([0.3, 0.1, 0.7]))
    np.testing.assert_allclose(rho, [0.4, 0.2, 0.7])
    np.testing.assert_allclose(density_slope(problem), [0.0, 0.5, 1.0])


def test_one_law_needs_no_weights():
    law = LawField(laws=(LAWS["waves"],))
    rho = np.array([0.2, 0.4])
    np.testing.assert_array_equal(law.stiffness(rho), LAWS["waves"].stiffness(rho))
    with pytest.raises(ValueError, match="need weights"):
        LawField(laws=tuple(LAWS.values()))


def test_a_transition_is_the_zone_with_its_weight(tmp_path, registry, two_thirds):
    """The border at 16 mm with 8 mm of ``3 s^2 - 2 s^3`` about it, as a weight by place."""
    zone = prepared(tmp_path, registry, WAVES)
    text = '[lattice.transition]\ncell = "waves"\nweight = "1 - smoothstep(12, 20, x)"\n'
    own = prepared(tmp_path, registry, text)
    points = np.random.default_rng(20260127).uniform(0, [32, 8, 8], (500, 3)).T
    weights = own.cells.zoning.weights(points)
    # A zone's border comes from a difference over 0.016 mm.
    np.testing.assert_allclose(weights, zone.cells.zoning.weights(points), atol=1e-9)
    assert own.cells.zoning.cells.shifts == zone.cells.zoning.cells.shifts
    assert own.cells.bounds == zone.cells.bounds
    for name in ("weights", "stiffness_factor", "strength_factor"):
        found, meant = (getattr(setup.homogenised.law, name) for setup in (own, zone))
        np.testing.assert_allclose(found, meant, atol=1e-9)
    assert [z.name for z in own.cells.zoning.zones] == ["lattice", "waves"]


def test_values_of_a_parameter_are_zones_in_a_row(tmp_path, registry, two_thirds):
    text = (
        '[lattice.parameter_map]\nparameter = "lean"\nvalues = [0.0, 0.4]\nincrements = 3\n'
        'formula = "0.4 * x / 32"\n'
    )
    (tmp_path / "case.toml").write_text(
        CASE.replace('"spirals"', '"leaning"\nlaw = "leaning-law"') + text
    )
    zoning = prepare(load_case(tmp_path), registry).cells.zoning
    x = np.array([0.0, 4.0, 8.0, 16.0, 24.0, 32.0])
    weights = zoning.weights(np.stack([x, np.full(6, 4.0), np.full(6, 4.0)]))
    place = x / 16
    hats = np.maximum(0, 1 - np.abs(place - np.arange(3)[:, None]))
    np.testing.assert_allclose(weights, hats, atol=1e-12)
    assert [dict(cell.parameters) for cell in zoning.cells.members] == [
        {"lean": pytest.approx(value)} for value in (0.0, 0.2, 0.4)
    ]
    assert set(zoning.cells.blends) == {(0, 1), (1, 2)}
    assert [zone.name for zone in zoning.zones] == ["lattice", "lean 0.2", "lean 0.4"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '[lattice.transition]\ncell = "waves"\nweight = "x / 16"\n',
            r"case\.toml:\d+: lattice\.transition: the weight of the transition is 2 at \(32, ",
        ),
        (
            '[lattice.transition]\ncell = "waves"\nweight = "0.5"\n' + WAVES,
            r"lattice\.transition: does not go with \[\[zone\]\]",
        ),
        (
            '[lattice.transition]\ncell = "nothing"\nweight = "0.5"\n',
            r"transition\.cell: .*noth",
        ),
        ('[[zone]]\ncell = "waves"\n', "found none; expected exactly one of box, cylinder"),
        ('[[zone]]\nformula = "x"\n', "differs in nothing"),
        ('[[zone]]\nregion = "root"\ncell = "waves"\n', "goes with region"),
        ('[[zone]]\nformula = "x + y +"\ncell = "waves"\n', "zone"),
        ('[[zone]]\nformula = "x - 900"\ncell = "nothing"\n', "nothing"),
        ('[[zone]]\nformula = "x + 90"\ncell = "waves"\n', "no place of the lattice lies in it"),
        (HALF.replace("8 mm", "2 mm") + 'cell = "waves"\n', "less than half a cell"),
        (
            WAVES + '[[zone]]\nformula = "12 - x"\ndensity = [0.4, 0.5]\n',
            "only two cells can mix",
        ),
        (WAVES + WAVES, "the name of another zone"),
    ],
)
def test_what_zones_cannot_be_is_refused(tmp_path, registry, text, message):
    with pytest.raises((CaseError, DensityError), match=message):
        prepared(tmp_path, registry, text)
