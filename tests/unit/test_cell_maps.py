"""Cell maps of every kind: coordinates at known points, refusals, and derivatives."""

import numpy as np
import pytest
from oracles.naive_size_map import naive_size_map

from gradedesign.errors import CaseError, LatticeError
from gradedesign.geometry.maps.cell_map import frame_along, require_regular, uniform_map
from gradedesign.geometry.maps.conformal_map import conformal_map, layered_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.spherical_map import spherical_map
from gradedesign.geometry.maps.warp_map import MorphingSphere, warp_map

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def dome(points):
    """Depth below a sphere of radius 80 mm about (0, 0, -60) mm."""
    return 80.0 - np.sqrt(points[0] ** 2 + points[1] ** 2 + (points[2] + 60.0) ** 2)


def cylinder():
    return cylindrical_map(around=12, radial_size=5.0, axial_size=4.0, inner_radius=10.0)


def sphere():
    return spherical_map(
        around=16, pole_to_pole=8, radial_size=5.0, inner_radius=10.0, polar_cap=20.0
    )


def warped(magnification=2.0):
    ball = MorphingSphere(
        centre=(2.0, 1.0, 0.0), stable_radius=8.0, outer_radius=20.0, magnification=magnification
    )
    return warp_map(uniform_map(4.0, origin=(1.0, 0.0, 0.0)), [ball])


MAPS = {
    "uniform": uniform_map((3.0, 4.0, 5.0), rotation=TURN),
    "cylindrical": cylindrical_map(
        around=9, radial_size=4.0, axial_size=6.0, inner_radius=2.0,
        origin=(1.0, -2.0, 0.5), axis=(1.0, 2.0, -1.0),
    ),
    "spherical": spherical_map(
        around=10, pole_to_pole=5, radial_size=4.0, inner_radius=3.0, polar_cap=15.0,
        origin=(-1.0, 2.0, 0.5), axis=(0.3, -0.2, 1.0),
    ),
    "warped": warped(),
    "shrunk": warped(0.6),
    "naive": naive_size_map(
        lambda p: 4.0 + 0.05 * p[0] - 0.02 * p[1] * p[2] / 10.0, step=1e-3, typical=4.0
    ),
    "conformal": conformal_map(dome, 6.0, normal=(0.1, 0.0, -1.0), origin=(0.0, 0.0, 20.0)),
    "layered": layered_map(
        dome, lambda p: 40.0 + p[2], 5, 6.0, normal=(0.0, 0.0, -1.0)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MAPS)
def test_derivative_agrees_with_differences(name):
    cell_map = MAPS[name]
    rng = np.random.default_rng(20261)
    points = rng.uniform(-14.0, 14.0, (3, 400))
    if cell_map.singular is not None:
        points = points[:, ~cell_map.singular(points)]
    h = 1e-4
    ahead = np.stack([cell_map(points + h * e[:, None]) for e in np.eye(3)], axis=1)
    back = np.stack([cell_map(points - h * e[:, None]) for e in np.eye(3)], axis=1)
    jump = np.abs(ahead - back).max(axis=(0, 1)) > 1.0  # the cut of an angle
    assert jump.mean() < 0.02
    exact = cell_map.jacobian(points)
    assert exact.shape == (3, 3, points.shape[1])
    error = np.abs(exact - (ahead - back) / (2 * h))[:, :, ~jump]
    assert error.max() < 1e-5


@pytest.mark.parametrize("name", MAPS)
def test_any_trailing_shape_and_no_input_is_changed(name):
    cell_map = MAPS[name]
    points = np.random.default_rng(20262).uniform(5.0, 14.0, (3, 4, 2, 3))
    kept = points.copy()
    u, slope = cell_map(points), cell_map.jacobian(points)
    assert u.shape == (3, 4, 2, 3)
    assert slope.shape == (3, 3, 4, 2, 3)
    np.testing.assert_allclose(u[:, 1, 1, 2], cell_map(points[:, 1, 1, 2:3])[:, 0], rtol=1e-12)
    np.testing.assert_array_equal(points, kept)


def test_cylinder_counts_layers_sectors_and_slices():
    # A quarter turn of 12 is 3 cells; 20 mm is two layers of 5 mm beyond 10 mm.
    u = cylinder()(np.array([[20.0, 0.0], [0.0, 15.0], [8.0, -4.0]]))
    np.testing.assert_allclose(u, [[2.0, 1.0], [0.0, 3.0], [2.0, -1.0]], atol=1e-12)


def test_cylinder_cells_join_after_a_turn():
    below, above = np.array([[-15.0], [-1e-9], [0.0]]), np.array([[-15.0], [1e-9], [0.0]])
    step = cylinder()(above) - cylinder()(below)
    np.testing.assert_allclose(step[:, 0], [0.0, 12.0, 0.0], atol=1e-8)


def test_sphere_counts_shells_parallels_and_meridians():
    # On the equator at a right angle to the first meridian: 4 of 8 parallels, 4 of 16 meridians.
    u = sphere()(np.array([[0.0], [25.0], [0.0]]))
    np.testing.assert_allclose(u[:, 0], [3.0, 4.0, 4.0], atol=1e-12)


@pytest.mark.parametrize(
    ("cell_map", "point", "place"),
    [
        (cylinder(), (0.0, 0.0, 3.0), "axis"),
        (cylinder(), (6.0, 7.0, 3.0), "axis"),
        (sphere(), (1.0, 0.0, 0.0), "centre"),
        (sphere(), (3.0, 3.0, 20.0), "pole"),
        (sphere(), (3.0, 3.0, -20.0), "pole"),
    ],
)
def test_singular_places_are_named_and_stay_finite(cell_map, point, place):
    points = np.array([[30.0, 30.0, 30.0], point]).T
    assert np.isfinite(cell_map(points)).all()
    with pytest.raises(LatticeError, match=place):
        require_regular(cell_map, points)
    require_regular(cell_map, points[:, :1])


def test_maps_without_singular_places_are_always_regular():
    require_regular(uniform_map(3.0), np.zeros((3, 4)))


def test_morphing_sphere_magnifies_inside_and_changes_nothing_outside():
    # Raymont 2011, figure 4.3: stable zone, transition zone, then nothing changes.
    base, ball = uniform_map(4.0, origin=(1.0, 0.0, 0.0)), warped()
    rng = np.random.default_rng(20263)
    direction = rng.normal(size=(3, 500))
    direction /= np.linalg.norm(direction, axis=0)
    centre = np.array([2.0, 1.0, 0.0])[:, None]
    outside = centre + direction * rng.uniform(20.0, 60.0, 500)
    assert np.abs(ball(outside) - base(outside)).max() <= 1e-12
    inside = centre + direction * rng.uniform(0.0, 8.0, 500)
    expected = np.broadcast_to(np.eye(3)[:, :, None] / 8.0, (3, 3, 500))
    np.testing.assert_allclose(ball.jacobian(inside), expected, atol=1e-14)
    np.testing.assert_allclose(ball(centre), base(centre), atol=1e-14)


def test_transition_is_smooth_and_never_folds():
    radius = np.linspace(1e-3, 25.0, 4001)
    points = np.array([2.0, 1.0, 0.0])[:, None] + np.array([[0.6], [0.0], [0.8]]) * radius
    for magnification in (0.5, 0.8, 1.0, 3.0, 20.0):
        if magnification == 0.5:
            ball = MorphingSphere(
                centre=(2.0, 1.0, 0.0), stable_radius=8.0, outer_radius=33.0, magnification=0.5
            )
            cell_map = warp_map(uniform_map(4.0), [ball])
        else:
            cell_map = warped(magnification)
        slope = cell_map.jacobian(points)
        assert np.linalg.det(np.moveaxis(slope, -1, 0)).min() > 0
        assert np.abs(np.diff(slope, axis=-1)).max() < 0.01


def test_layers_follow_the_surface():
    layers = conformal_map(dome, (6.0, 5.0, 4.0), normal=(0.0, 0.0, -1.0), origin=(0.0, 0.0, 20.0))
    angle = np.linspace(-0.5, 0.5, 11)
    shell = np.stack([78.0 * np.sin(angle), 0 * angle, 78.0 * np.cos(angle) - 60.0])
    np.testing.assert_allclose(layers(shell)[2], 0.5, atol=1e-12)  # 2 mm deep, layers of 4 mm


def test_layers_between_two_surfaces_are_whole():
    slab = layered_map(lambda p: 10.0 - p[2], lambda p: p[2] + 5.0, 3, 6.0, normal=(0.0, 0.0, -1.0))
    u = slab(np.array([[0.0, 0.0], [0.0, 0.0], [10.0, -5.0]]))
    np.testing.assert_allclose(u[2], [0.0, 3.0])


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: cylindrical_map(around=7.5, radial_size=1, axial_size=1, inner_radius=1), "whole"),
        (lambda: cylindrical_map(around=0, radial_size=1, axial_size=1, inner_radius=1), "whole"),
        (lambda: cylindrical_map(around=6, radial_size=0, axial_size=1, inner_radius=1), "radial"),
        (lambda: cylindrical_map(around=6, radial_size=1, axial_size=1, inner_radius=0), "inner"),
        (lambda: cylindrical_map(around=6, radial_size=1, axial_size=np.nan, inner_radius=1),
         "axial"),
        (lambda: spherical_map(around=6, pole_to_pole=2.5, radial_size=1, inner_radius=1,
                               polar_cap=9), "pole to pole"),
        (lambda: spherical_map(around=6, pole_to_pole=3, radial_size=-1, inner_radius=1,
                               polar_cap=9), "radial size"),
        (lambda: spherical_map(around=6, pole_to_pole=3, radial_size=1, inner_radius=1,
                               polar_cap=0), "polar cap"),
        (lambda: frame_along((0, 0, 0)), "no direction"),
        (lambda: conformal_map(dome, 0.0, normal=(0, 0, 1)), "cell size"),
        (lambda: layered_map(dome, dome, 0, 1.0, normal=(0, 0, 1)), "whole"),
        (lambda: MorphingSphere(centre=np.zeros(3), stable_radius=5, outer_radius=5,
                                magnification=2), "outer radius"),
        (lambda: MorphingSphere(centre=np.zeros(3), stable_radius=5, outer_radius=9,
                                magnification=0), "positive"),
        (lambda: MorphingSphere(centre=np.zeros(3), stable_radius=5, outer_radius=9,
                                magnification=0.5), "at least 20 mm"),
        (lambda: MorphingSphere(centre=np.zeros(3), stable_radius=5, outer_radius=900,
                                magnification=0.3), "1/3"),
        (lambda: warp_map(uniform_map(1.0), [
            MorphingSphere(centre=np.full(3, c), stable_radius=1, outer_radius=2, magnification=2)
            for c in (0.0, 1.0)]), "overlap"),
    ],
)  # fmt: skip
def test_impossible_maps_are_refused(build, words):
    with pytest.raises(CaseError, match=words):
        build()
