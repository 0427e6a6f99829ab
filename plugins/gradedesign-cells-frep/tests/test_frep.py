"""The function-based cells; expected numbers are shares and volumes of elementary geometry."""

import numpy as np
import pytest

from gradedesign import CaseError, DensityError, PluginError
from gradedesign.fields import r_intersection, r_union
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.testing import check_cell_family
from gradedesign_cells_frep import Pores, gradedesign_cell_families, pore_family
from gradedesign_cells_frep.honeycomb_plates import STRETCH, hexagons, triangles
from gradedesign_cells_frep.r_functions import displacement, r_and, r_or, r_or_of_three
from gradedesign_cells_frep.solid_noise import series, solid_noise

FAMILIES = {family.name: family for family in gradedesign_cell_families()}
PI = np.pi

#: Quick and different ones at once, the rest with the slow tests.
QUICK = {"slabs", "rods", "octahedron-pores", "slotted-plates"}


def samples(count=200_000):
    """Points that fill the cell evenly: an additive recurrence with the plastic number's kin."""
    step = 1.2207440846057596 ** -np.arange(1.0, 4.0)
    return np.mod(0.3141 + step[:, None] * np.arange(count), 1.0)


POINTS = samples()


def density(name, level, **parameters):
    return float(np.mean(FAMILIES[name].shape(POINTS, **parameters) <= level))


def share(threshold):
    """Share of a period in which a sine is at least a threshold."""
    return 0.5 - np.arcsin(threshold) / PI


def test_every_cell_is_there():
    pores = {"sphere", "ellipsoid", "cube", "octahedron", "cylinder"}
    assert set(FAMILIES) == {
        *(f"{shape}-pores{end}" for shape in pores for end in ("", "-noise")),
        *(f"sphere-pores-{end}" for end in ("bcc", "fcc", "sine")),
        *("slabs", "rods", "rods-orthotropic", "rods-smooth", "rods-blended"),
        *("slotted-plates", "honeycomb-plates", "triangle-plates"),
    }
    assert all(family.source for family in FAMILIES.values())


@pytest.mark.parametrize(
    "family",
    [
        pytest.param(family, id=name, marks=[] if name in QUICK else [pytest.mark.slow])
        for name, family in FAMILIES.items()
    ],
)
def test_conforms(family):
    check_cell_family(family)


@pytest.mark.parametrize("level", [-0.8, 0.0, 0.5])
def test_rods_are_square_bars_of_the_sine(level):
    w = share(-level)
    assert density("rods", level) == pytest.approx(3 * w**2 - 2 * w**3, abs=7e-4)
    # At level 0 smooth operations and sharp ones have the same solid.
    smooth = density("rods-smooth", 0.0, threshold=-level)
    assert smooth == pytest.approx(3 * w**2 - 2 * w**3, abs=7e-4)


def test_rods_by_axis():
    # Bars along x are crossed from bars of the y and z slabs: pairs of shares less twice all three.
    x, y, z = (share(limit + 0.3) for limit in (0.0, 0.2, -0.1))
    found = density(
        "rods-orthotropic", -0.3, frequency_y=3.0, threshold_y=0.2, threshold_z=-0.1, phase_x=0.2
    )
    assert found == pytest.approx(x * y + y * z + z * x - 2 * x * y * z, abs=7e-4)


@pytest.mark.parametrize(("web", "t"), [(0.15, 0.03), (0.15, 0.2), (0.3, 0.1), (0.0, 0.1)])
@pytest.mark.parametrize("frequency", [1.0, 2.0])
def test_slabs_less_tunnels(web, t, frequency):
    # Not one slab, or a slab and both others beyond the frame: independent shares.
    w, frame = 2 * t, 2 * min(t + web, 0.5)
    expected = 1 - (1 - w) ** 3 - 3 * w * (1 - frame) ** 2
    found = density("slabs", t / frequency, web=web / frequency, frequency=frequency)
    assert found == pytest.approx(expected, abs=7e-4)


def ball_overlap(r, half):
    """Volume of two equal balls' common lens, centres 2 half apart: two caps."""
    height = max(r - half, 0.0)
    return 2 * PI * height**2 * (3 * r - height) / 3


@pytest.mark.parametrize("r", [0.2, 0.45, 0.5, 0.6, 0.7])
def test_round_pores(r):
    # 1 - 4/3 pi r^3; from 1/2 on less the lenses with three of the six neighbours.
    solid = 1 - 4 / 3 * PI * r**3 + 3 * ball_overlap(r, 0.5)
    assert density("sphere-pores", -r) == pytest.approx(solid, abs=7e-4)
    half = density("sphere-pores", -r / 2, frequency=2.0, phase=0.3)
    assert half == pytest.approx(solid, abs=7e-4)


@pytest.mark.parametrize(("name", "count"), [("bcc", 2), ("fcc", 4)])
def test_round_pores_on_other_lattices(name, count):
    # Pores with channels far thinner than them, apart: at most count 4/3 pi r^3 and the channels.
    r = 0.3
    pores = count * 4 / 3 * PI * r**3
    bonds = {"bcc": 8 * (0.75**0.5 - 2 * r), "fcc": 24 * (0.5**0.5 - 2 * r)}[name]
    channels = bonds * PI * (0.05 * r) ** 2
    found = density(f"sphere-pores-{name}", -r, channel=0.05)
    assert found == pytest.approx(1 - pores - channels, abs=1e-3)


def test_round_pores_open_where_they_touch():
    # Void closed above 1 - pi / 6; solid in pieces below the density at r = sqrt(1/2), where the
    # pores reach the middles of the faces.
    r = 0.5**0.5
    floor = 1 - 4 / 3 * PI * r**3 + 3 * ball_overlap(r, 0.5)
    window = calibrate(FAMILIES["sphere-pores"]).window
    assert window == pytest.approx((floor, 1 - PI / 6), abs=0.003)


def test_sine_pores_are_the_primitive_surface():
    # Known limits of the primitive network: 0.2141 and its complement.
    window = calibrate(FAMILIES["sphere-pores-sine"]).window
    assert window == pytest.approx((0.2141, 0.7859), abs=0.003)
    points = POINTS[:, :99]
    value = FAMILIES["sphere-pores-sine"].shape(points)
    primitive = np.cos(2 * PI * points).sum(axis=0)
    np.testing.assert_allclose((PI * value) ** 2, 1.5 - 0.5 * primitive, atol=1e-12)
    # Small ones are balls.
    assert density("sphere-pores-sine", -0.05) == pytest.approx(1 - 4 / 3 * PI * 0.05**3, abs=1e-4)


def test_other_pores():
    r, axes = 0.4, (1.0, 0.8, 1.2)
    ellipsoids = density("ellipsoid-pores", -r, axis_x=1.0, axis_y=0.8, axis_z=1.2)
    assert ellipsoids == pytest.approx(1 - 4 / 3 * PI * np.prod(axes) * r**3, abs=7e-4)
    for r in (0.3, 0.7):
        octahedra = 1 - 4 / 3 * r**3 + 4 * max(r - 0.5, 0) ** 3
        assert density("octahedron-pores", -r) == pytest.approx(octahedra, abs=7e-4)
    for r in (0.1, 0.4):
        cylinders = 1 - 3 * PI * r**2 + 8 * 2**0.5 * r**3
        assert density("cylinder-pores", -r) == pytest.approx(cylinders, abs=7e-4)
    for r, neck in ((0.3, 0.5), (0.45, 0.2)):
        cubes = 1 - 8 * r**3 - 12 * (neck * r) ** 2 * (1 - 2 * r)
        assert density("cube-pores", 0.5 - r, neck=neck) == pytest.approx(cubes, abs=7e-4)


def test_pores_of_ones_own():
    # A tilted ellipsoid, whose copies have to be compared: volume 4/3 pi a b c of any tilt.
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])

    def tilted(p, *, long=2.0):
        q = np.einsum("ij,j...->i...", turn, p)
        return np.sqrt((q[0] / long) ** 2 + q[1] ** 2 + q[2] ** 2)

    family = pore_family("my-pores", Pores(gauge=tilted), parameters={"long": 2.0}, source="me")
    value = family.shape(POINTS, long=2.5)
    assert np.mean(value <= -0.19) == pytest.approx(1 - 4 / 3 * PI * 2.5 * 0.19**3, abs=7e-4)
    assert dict(family.parameters) == {"frequency": 1.0, "phase": 0.0, "long": 2.0}
    moved = family.shape(POINTS[:, :99] + np.array([[1.0], [-2.0], [1.0]]))
    np.testing.assert_allclose(moved, family.shape(POINTS[:, :99]), atol=1e-12)


@pytest.mark.parametrize(
    ("places", "parameters", "message"),
    [
        ({}, {"seed": 1.0}, "seed has a name"),
        ({"centres": [[0.0, 0.0]]}, {}, r"shape \(1, 2\), expected \(k, 3\)"),
        ({"centres": [[0.0, 0.0, np.nan]]}, {}, "finite"),
    ],
)
def test_impossible_pores_are_refused(places, parameters, message):
    pores = Pores(gauge=lambda p: np.abs(p).max(axis=0), **places)
    with pytest.raises(PluginError, match=message):
        pore_family("mine", pores, parameters=parameters)


def test_r_functions_are_those_of_the_core():
    first, second, third = np.random.default_rng(77).normal(size=(3, 500))
    union = r_union(lambda _: first, lambda _: second)(POINTS)
    both = r_intersection(lambda _: first, lambda _: second)(POINTS)
    np.testing.assert_allclose(r_or(first, second), union)
    np.testing.assert_allclose(r_and(first, second), both)
    three = r_or_of_three(first, second, third)
    assert ((three < 0) == (np.minimum(np.minimum(first, second), third) < 0)).all()
    np.testing.assert_allclose(three, r_or_of_three(third, first, second), atol=1e-12)
    assert np.abs(three - r_or(r_or(first, second), third)).max() > 0.01


def test_displacement_is_that_of_equation_7():
    # At the corner of two surfaces -a0, at one width from both -a0 / 3, sign turned.
    ends = np.array([0.0, 0.5])
    found = displacement(0.3, 0.5, ends, ends)
    np.testing.assert_allclose(found, [-0.3, -0.1])
    np.testing.assert_allclose(displacement(0.3, 0.5, ends, ends, ends), [-0.9, -0.3])


def test_blends_round_edges_and_fill_corners():
    family = FAMILIES["rods-blended"]
    plain = {"edge": 0.0, "fillet": 0.0}
    np.testing.assert_array_equal(
        family.shape(POINTS[:, :999], **plain), FAMILIES["rods-smooth"].shape(POINTS[:, :999])
    )
    sharp = density("rods-blended", 0.0, **plain)
    assert density("rods-blended", 0.0, edge=-0.2, fillet=0.0) < sharp - 0.01
    assert density("rods-blended", 0.0, edge=0.0, fillet=0.2) > sharp + 0.01
    # On an edge of a rod half-way between nodes, where two slabs end: 0 sharp, above 0 chamfered.
    limit = np.arcsin(0.5) / (2 * PI)
    edge = np.array([0.0, limit + 0.25, limit + 0.25])
    assert float(family.shape(edge, **plain)) == pytest.approx(0.0, abs=1e-12)
    assert float(family.shape(edge, edge=-0.2, fillet=0.0)) > 0.1


def slow_noise(u, seed):
    waves, coefficients = series(seed)
    angle = 2 * PI * (waves @ u)
    return (coefficients[:, :, None] * np.exp(1j * angle)).real.sum(axis=1)


@pytest.mark.slow
def test_noise_is_a_periodic_series_of_mean_square_one():
    points = POINTS[:, :400]
    value = solid_noise(points, 12)
    np.testing.assert_allclose(value, slow_noise(points, 12), atol=1e-10)
    np.testing.assert_allclose(solid_noise(points + 3.0, 12), value, atol=1e-10)
    assert np.abs(solid_noise(points, 13) - value).max() > 1
    # A grid finer than the waves has exact means.
    axis = np.arange(8) / 8
    grid = solid_noise(np.stack(np.meshgrid(axis, axis, axis)), 12)
    np.testing.assert_allclose(grid.mean(axis=(1, 2, 3)), 0.0, atol=1e-12)
    np.testing.assert_allclose((grid**2).mean(axis=(1, 2, 3)), 1.0, atol=1e-12)
    assert solid_noise(points.astype(np.float32), 12).dtype == np.float32


def test_noise_moves_pores_without_changing_their_mean_volume():
    plain = {"noise_place": 0.0, "noise_size": 0.0}
    noisy, quiet = FAMILIES["sphere-pores-noise"], FAMILIES["sphere-pores"]
    points = POINTS[:, :9999]
    np.testing.assert_array_equal(noisy.shape(points, **plain), quiet.shape(points))
    small = 1e-3 * np.abs(solid_noise(points, 5)[3]).max()
    apart = noisy.shape(points, noise_place=0.0, noise_size=1e-3, seed=5.0) - quiet.shape(points)
    assert 0.99 * small < np.abs(apart).max() <= small * (1 + 1e-9)
    found = [density("sphere-pores-noise", -0.4, seed=float(k)) for k in (3, 4, 5, 6)]
    assert len(set(found)) == 4
    assert np.mean(found) == pytest.approx(1 - 4 / 3 * PI * 0.4**3, abs=0.02)


def polygon_distance(corners, x, y):
    """Distance to the sides of a polygon, the slow way."""
    least = np.full(x.shape, np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = b - a
        s = np.clip(((x - a[0]) * side[0] + (y - a[1]) * side[1]) / (side @ side), 0, 1)
        least = np.minimum(least, np.hypot(x - a[0] - s * side[0], y - a[1] - s * side[1]))
    return least


@pytest.mark.parametrize(
    ("polygons", "corners", "centres"),
    [
        (hexagons, 30 + 60 * np.arange(6), [(i + j / 2, j * 0.75**0.5) for i in range(-2, 4)
                                            for j in range(-2, 5)]),
        (triangles, 90 + 120 * np.arange(3), [(i + 0.5 + j / 2, 0.75**0.5 * (j + 1 / 3))
                                              for i in range(-3, 4) for j in range(-2, 5)]),
    ],
)  # fmt: skip
def test_honeycombs_are_regular(polygons, corners, centres):
    rng = np.random.default_rng(77)
    x, y = rng.uniform(0, 1, 600), rng.uniform(0, 3**0.5, 600)
    angle = np.radians(corners)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) / 3**0.5
    distance, crossing = np.full(600, np.inf), np.full(600, np.inf)
    for centre in np.array(centres):
        distance = np.minimum(distance, polygon_distance(centre + ring, x, y))
        for corner in centre + ring:
            crossing = np.minimum(crossing, np.hypot(x - corner[0], y - corner[1]))
    found = polygons(x, y)
    np.testing.assert_allclose(found[0], distance, atol=1e-12)
    np.testing.assert_allclose(found[1], crossing, atol=1e-12)


@pytest.mark.parametrize("t", [0.03, 0.1])
def test_plates_without_slots(t):
    # Void squares and hexagons of distance 1 - 2 t across; triangles of height sqrt(3)/2 - 3 t.
    assert density("slotted-plates", t, slot=0.0) == pytest.approx(4 * t - 4 * t**2, abs=7e-4)
    assert density("honeycomb-plates", t, slot=0.0) == pytest.approx(4 * t - 4 * t**2, abs=7e-4)
    triangle = 1 - (1 - 2 * 3**0.5 * t) ** 2
    assert density("triangle-plates", t, slot=0.0) == pytest.approx(triangle, abs=7e-4)
    assert STRETCH == (1.0, 3**0.5, 1.0)


def test_slots_leave_columns():
    # Within the slots of square plates: discs of radius c about the crossing lines, cut to the
    # plates; c + t well below 1/2. The part of a disc of radius R within t of one of two crossing
    # lines: 2 strips of 4 times the quarter-strip area less the common square.
    t, slot, column = 0.04, 0.5, 0.15
    reach = column + t
    strip = 2 * (t * (reach**2 - t**2) ** 0.5 + reach**2 * np.arcsin(t / reach))
    cross = 2 * strip - 4 * t**2
    band = slot - 2 * t
    expected = (1 - band) * (4 * t - 4 * t**2) + band * cross
    found = density("slotted-plates", t, slot=slot, column=column)
    assert found == pytest.approx(expected, abs=7e-4)
    half = density("slotted-plates", t, slot=slot / 2 + t, column=column, frequency_z=2.0)
    assert half == pytest.approx(expected, abs=7e-4)


def test_closed_honeycombs_are_refused():
    with pytest.raises(DensityError, match="open void"):
        calibrate(FAMILIES["honeycomb-plates"], {"slot": 0.0}, 32)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("rods", {"frequency": 1.5}, "frequency is 1.5, expected a whole number, 1 to 8"),
        ("rods", {"phase": np.nan}, "phase is nan"),
        ("rods-orthotropic", {"threshold_z": 1.0}, "threshold is 1, expected -0.99 to 0.99"),
        ("rods-blended", {"width": 0.0}, "width is 0, expected 0.05 to 2"),
        ("slabs", {"web": 0.3, "frequency": 2.0}, "web is 0.3, expected 0 to 0.225"),
        ("sphere-pores", {"frequency": 0.0}, "frequency is 0"),
        ("sphere-pores-fcc", {"channel": 0.0}, "channel is 0, expected 0.05 to 1"),
        ("sphere-pores-noise", {"seed": 0.5}, "seed is 0.5, expected a whole number"),
        ("sphere-pores-noise", {"noise_place": 0.5}, "noise_place is 0.5"),
        ("ellipsoid-pores", {"axis_y": 0.0}, "axis_y is 0, expected 0.3 to 3"),
        ("cube-pores", {"neck": 2.0}, "neck is 2, expected 0.05 to 1"),
        ("honeycomb-plates", {"slot": 1.0}, "slot is 1, expected 0 to 0.9"),
        ("slotted-plates", {"column": 0.0}, "column is 0, expected 0.02 to 0.3"),
    ],
)
def test_parameters_out_of_range_are_refused(name, parameters, message):
    with pytest.raises(CaseError, match=message):
        FAMILIES[name].shape(POINTS[:, :3], **parameters)
