"""Profiles over the thickness of walls: their moments, shear, derivatives and places."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gradedesign.errors import DensityError
from gradedesign.mechanics.fe.collapsed_rule import collapsed_rule
from gradedesign.mechanics.fe.stiffness import pair_products
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


def random_stiffness(tets=40, seed=5):
    """Symmetric matrices of the periodic lattice and their derivatives, ``(6, 6, M)``."""
    both = np.random.default_rng(seed).uniform(0.5, 1.5, (2, 6, 6, tets))
    return both + both.transpose(0, 2, 1, 3)


def test_slopes_are_those_of_the_values():
    walls = some_walls()
    rho = np.random.default_rng(4).uniform(0.21, 0.39, 40)
    step = 1e-6
    C, slope = random_stiffness()
    found = walls.stiffness_slope(C, slope, rho)
    above, below = (walls.stiffness(C + d * slope, rho + d) for d in (step, -step))
    np.testing.assert_allclose(found, (above - below) / (2 * step), rtol=1e-5, atol=1e-7)
    rise = (walls.solid(rho + step) - walls.solid(rho - step)) / (2 * step)
    np.testing.assert_allclose(walls.solid_slope(rho), rise, rtol=1e-5, atol=1e-7)


def test_moments_are_those_of_the_profiles_at_the_points():
    """Walls across none to three axes, point by point as their classes say it."""
    walls = some_walls()
    rho, (C, _) = np.full(40, walls.density[1]), random_stiffness()
    square = np.ones((6, walls.weights.size, 40))
    # In the plane of a wall, and across it.
    rows = [((1, 2, 3), (5, 4)), ((2, 0, 4), (3, 5)), ((0, 1, 5), (4, 3))]
    for axis, (inside, across) in enumerate(rows):
        for number, wall in enumerate(walls.classes):
            tets = np.flatnonzero(walls.kind[axis] == number)
            z = walls.height[axis][:, tets]
            for entry, row in enumerate(inside):
                square[row][:, tets] *= profile(wall, 1, entry, z)
            for entry, row in enumerate(across):
                square[row][:, tets] *= wall.shear[1, entry]
    D = np.sqrt(square)
    turn = pair_products(walls.points, walls.weights)
    expected = np.einsum("pq,iqm,ijm,jqm->ijpm", turn, D, C, D)
    np.testing.assert_allclose(walls.stiffness(C, rho), expected, rtol=1e-12)
    assert {0, 1, 2, 3} == set((walls.kind >= 0).sum(axis=0))


def test_where_there_is_no_wall_nothing_changes():
    walls = some_walls()
    none = (walls.kind < 0).all(axis=0)
    assert none.any()
    rho = np.full(40, 0.3)
    # Means of the products of two coordinates: 1/10 of a square, 1/20 of two (Dirichlet).
    one = np.array([0.1 if s == t else 0.05 for s in range(4) for t in range(s, 4)])
    moments = walls.stiffness(np.ones((6, 6, 40)), rho) / one[:, None]
    np.testing.assert_allclose(moments[:, :, :, none], 1.0, rtol=1e-12)
    assert np.abs(moments[:, :, :, ~none] - 1).max() > 0.05


def test_beyond_the_known_densities_is_an_error():
    with pytest.raises(DensityError, match=r"0\.1 to 0\.4, but were asked for 0\.5"):
        some_walls().stiffness(np.ones((6, 6, 40)), np.full(40, 0.5))
