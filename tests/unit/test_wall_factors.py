"""Profiles over the thickness of walls: their moments, shear, derivatives and places."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.errors import DensityError
from gradedesign.mechanics.fe.collapsed_rule import collapsed_rule
from gradedesign.mechanics.sizing.wall_factors import WallFactors, _parts, wall_class

RATIO = st.floats(0.1, 2.6)


def profile(wall, row, entry, z):
    far, near = _parts(z, wall.exponent)
    return (
        wall.mean[row, entry]
        + wall.outward[row, entry] * (far - 1)
        + wall.inward[row, entry] * (near - 1)
    )


@given(
    membrane=st.lists(st.floats(0.2, 3.0), min_size=3, max_size=3),
    relative=st.lists(RATIO, min_size=3, max_size=3),
)
@settings(max_examples=60, deadline=None)
def test_profiles_have_the_walls_membrane_and_bending_stiffness(membrane, relative):
    membrane, bending = np.array([membrane]), np.array([relative]) * [membrane]
    wall = wall_class(np.ones(1), membrane, bending, np.ones((1, 2)))
    z, weight = np.polynomial.legendre.leggauss(200)
    for entry in range(3):
        values = profile(wall, 0, entry, z)
        assert values.min() > 0
        assert 0.5 * weight @ values == pytest.approx(membrane[0, entry], rel=1e-9)
        assert 1.5 * weight @ (values * z**2) == pytest.approx(bending[0, entry], rel=1e-9)


def test_shear_is_that_of_the_wall_whatever_the_profile():
    # Two faces of a sandwich carry their shear with the whole core: the factor on G falls to 5/6.
    ones = np.ones((1, 3))
    uniform = wall_class(np.ones(1), ones, ones, np.ones((1, 2)))
    np.testing.assert_allclose(uniform.shear, 1.0, rtol=1e-5)
    sandwich = wall_class(np.ones(1), ones, 2.6 * ones, np.ones((1, 2)))
    assert 5 / 6 < sandwich.shear[0, 0] < 0.87


@pytest.mark.parametrize("relative", [2.99, 0.01])
def test_impossible_bending_is_refused(relative):
    ones = np.ones((1, 3))
    with pytest.raises(DensityError, match="times as stiff in bending"):
        wall_class(np.ones(1), ones, relative * ones, np.ones((1, 2)))


def some_walls(tets=40, seed=3):
    rng = np.random.default_rng(seed)
    points, weights = collapsed_rule(2)
    density = np.array([0.1, 0.2, 0.4])

    def rows(low, high, n):
        return rng.uniform(low, high, (3, n))

    classes = []
    for _ in range(2):
        membrane = rows(0.6, 1.3, 3)
        classes.append(
            wall_class(
                rows(0.9, 1.2, 1)[:, 0], membrane, membrane * rows(0.4, 2.2, 3), rows(0.5, 1.1, 2)
            )
        )
    return WallFactors(
        density=density,
        classes=tuple(classes),
        kind=rng.integers(-1, 2, (3, tets)),
        height=rng.uniform(-1, 1, (3, weights.size, tets)),
        points=points,
        weights=weights,
    )


def test_slopes_are_those_of_the_values():
    walls = some_walls()
    rho = np.random.default_rng(4).uniform(0.21, 0.39, 40)
    step = 1e-6
    moments, slope = walls.moments_with_slope(rho)
    np.testing.assert_array_equal(moments, walls.moments(rho))
    rise = (walls.moments(rho + step) - walls.moments(rho - step)) / (2 * step)
    np.testing.assert_allclose(slope, rise, rtol=1e-5, atol=1e-7)
    assert np.abs(slope).max() > 0.01
    rise = (walls.solid(rho + step) - walls.solid(rho - step)) / (2 * step)
    np.testing.assert_allclose(walls.solid_slope(rho), rise, rtol=1e-5, atol=1e-7)


def test_moments_are_those_of_the_profiles_at_the_points():
    # One wall across x, point by point as the class says it.
    walls = some_walls()
    (tets,) = np.nonzero((walls.kind[0] == 0) & (walls.kind[1:] < 0).all(axis=0))
    tet = tets[0]
    wall = walls.classes[0]
    rho = np.full(40, walls.density[1])
    expected = np.zeros((6, 6, 10))
    pairs = [(s, t) for s in range(4) for t in range(s, 4)]
    for q, weight in enumerate(walls.weights):
        z = walls.height[0, q, tet]
        square = np.ones(6)
        # In its plane yy, zz and yz, across it xy and xz.
        square[[1, 2, 3]] = [profile(wall, 1, entry, z) for entry in range(3)]
        square[[5, 4]] = wall.shear[1]
        D = np.sqrt(square)
        for k, (s, t) in enumerate(pairs):
            expected[:, :, k] += weight * walls.points[q, s] * walls.points[q, t] * np.outer(D, D)
    np.testing.assert_allclose(walls.moments(rho)[:, :, :, tet], expected, rtol=1e-12)


def test_where_there_is_no_wall_nothing_changes():
    walls = some_walls()
    none = (walls.kind < 0).all(axis=0)
    assert none.any()
    rho = np.full(40, 0.3)
    # Means of the products of two coordinates: 1/10 of a square, 1/20 of two (Dirichlet).
    one = np.array([0.1 if s == t else 0.05 for s in range(4) for t in range(s, 4)])
    moments = walls.moments(rho) / one[:, None]
    np.testing.assert_allclose(moments[:, :, :, none], 1.0, rtol=1e-12)
    assert np.abs(moments[:, :, :, ~none] - 1).max() > 0.05


def test_beyond_the_known_densities_is_an_error():
    with pytest.raises(DensityError, match=r"0\.1 to 0\.4, but were asked for 0\.5"):
        some_walls().moments(np.full(40, 0.5))
