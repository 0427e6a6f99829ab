"""Algebra of implicit fields; expected numbers are plane and circle geometry."""

import numpy as np
import pytest

from gradedesign.errors import PluginError
from gradedesign.fields import (
    blend_intersection,
    blend_union,
    complement,
    difference,
    gradient,
    intersection,
    level_set_points,
    offset,
    periodic_distance_to_level_set,
    r_intersection,
    r_union,
    shell,
    union,
)


def ball(centre, radius):
    return lambda p: (
        np.linalg.norm(p - np.reshape(centre, (3, *[1] * (p.ndim - 1))), axis=0) - radius
    )


LEFT, RIGHT = ball((-0.5, 0, 0), 1.0), ball((0.5, 0, 0), 1.0)
POINTS = np.random.default_rng(77).uniform(-2, 2, (3, 4000))


@pytest.mark.parametrize(
    ("field", "rule"),
    [
        (union(LEFT, RIGHT), lambda a, b: a | b),
        (intersection(LEFT, RIGHT), lambda a, b: a & b),
        (difference(LEFT, RIGHT), lambda a, b: a & ~b),
        (complement(LEFT), lambda a, _: ~a),
        (r_union(LEFT, RIGHT), lambda a, b: a | b),
        (r_intersection(LEFT, RIGHT), lambda a, b: a & b),
        (blend_union(LEFT, RIGHT, 0.0), lambda a, b: a | b),
        (blend_intersection(LEFT, RIGHT, 0.0), lambda a, b: a & b),
    ],
)
def test_sign_follows_the_set_operation(field, rule):
    inside = rule(LEFT(POINTS) < 0, RIGHT(POINTS) < 0)
    np.testing.assert_array_equal(field(POINTS) < 0, inside)


def test_offset_grows_by_the_distance():
    assert offset(LEFT, 0.25)(np.array([0.75, 0.0, 0.0])) == pytest.approx(0.0, abs=1e-15)


def test_shell_is_the_layer_inside():
    # Ball of radius 1 about (-0.5, 0, 0), shell 0.2: solid between radii 0.8 and 1.
    x = np.array([0.29, 0.31, 0.49, 0.51])
    value = shell(LEFT, 0.2)(np.stack([x, 0 * x, 0 * x]))
    np.testing.assert_array_equal(value < 0, [False, True, True, False])
    with pytest.raises(ValueError, match="empty"):
        shell(LEFT, 0.0)


def test_fillet_between_perpendicular_planes_is_an_arc_of_the_radius():
    blend = blend_union(lambda p: p[0], lambda p: p[1], 3.0)
    angle = np.linspace(np.pi, 1.5 * np.pi, 9)
    arc = np.stack([3 + 3 * np.cos(angle), 3 + 3 * np.sin(angle), 0 * angle])
    np.testing.assert_allclose(blend(arc), 0, atol=1e-12)
    far = np.array([[0.5, 9.0], [7.0, 0.25], [0, 0]])
    np.testing.assert_allclose(blend(far), [0.5, 0.25])


def test_rounding_of_a_convex_edge_has_the_radius():
    blend = blend_intersection(lambda p: p[0], lambda p: p[1], 2.0)
    angle = np.linspace(0, 0.5 * np.pi, 9)
    arc = np.stack([-2 + 2 * np.cos(angle), -2 + 2 * np.sin(angle), 0 * angle])
    np.testing.assert_allclose(blend(arc), 0, atol=1e-12)


def test_impossible_arguments_are_refused():
    with pytest.raises(ValueError, match="radius"):
        blend_union(LEFT, RIGHT, -1.0)
    with pytest.raises(ValueError, match="at least one"):
        union()


def planes(u):
    """Zero on the planes z = 0.1 and z = 0.6."""
    return np.sin(2 * np.pi * (u[2] - 0.1))


def test_distance_to_planes_is_exact_but_at_the_ridges():
    distance = periodic_distance_to_level_set(planes, resolution=32)
    u = np.random.default_rng(5).uniform(-3, 3, (3, 2000))
    w = np.mod(u[2] - 0.1, 0.5)
    expected = np.where(np.mod(u[2] - 0.1, 1.0) < 0.5, 1.0, -1.0) * np.minimum(w, 0.5 - w)
    clear = np.abs(np.abs(expected) - 0.25) > 0.12
    np.testing.assert_allclose(distance(u)[clear], expected[clear], atol=1e-4)
    np.testing.assert_allclose(distance(u), expected, atol=0.01)


def test_distance_keeps_shape_and_input():
    distance = periodic_distance_to_level_set(planes, resolution=24)
    u = np.random.default_rng(6).random((3, 2, 3, 4))
    before = u.copy()
    assert distance(u).shape == (2, 3, 4)
    assert distance(u[:, 0, 0, 0]).shape == ()
    np.testing.assert_array_equal(u, before)


def test_distance_solid_of_the_gyroid_has_steiners_volume():
    # Tube formula of a minimal surface: rho = s r + (pi chi / 6) r^3, s = 3.0914, chi = -8, and
    # the "G true" column of reference ramirez.md R4: 0.1230, 0.3053, 0.4496, 0.5853 (+-0.3 %).
    def gyroid(u):
        x, y, z = 2 * np.pi * u
        return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)

    distance = periodic_distance_to_level_set(gyroid)
    axis = (np.arange(90) + 0.37) / 90
    value = np.abs(distance(np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))))
    for r, true in ((0.04, 0.1230), (0.10, 0.3053), (0.15, 0.4496), (0.20, 0.5853)):
        share = float(np.mean(value <= r / 2))
        assert share == pytest.approx(true, rel=0.005)
        assert share == pytest.approx(3.0914 * r - 4.1888 * r**3, rel=0.004)


def test_level_set_points_lie_on_the_level():
    points = level_set_points(planes, level=0.3, resolution=16)
    np.testing.assert_allclose(planes(points), 0.3, atol=1e-10)
    assert points.shape[1] == 2 * 16**2


def test_gradient_matches_the_analytic_one():
    u = np.random.default_rng(8).random((3, 50))
    expected = np.stack([0 * u[0], 0 * u[0], 2 * np.pi * np.cos(2 * np.pi * (u[2] - 0.1))])
    np.testing.assert_allclose(gradient(planes, u), expected, atol=1e-7)


def test_unusable_functions_are_named():
    with pytest.raises(PluginError, match="nowhere"):
        level_set_points(planes, level=2.0, resolution=8)
    with pytest.raises(PluginError, match="not finite"):
        level_set_points(lambda u: u[0] * np.nan, resolution=8)
    with pytest.raises(PluginError, match="shape"):
        level_set_points(lambda u: u, resolution=8)
