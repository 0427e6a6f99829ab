"""Local stress between strength surfaces, and the density that holds it, on made-up surfaces."""

import numpy as np
import pytest

from gradedesign.errors import DensityError
from gradedesign.mechanics.homogenise.macro_directions import spread_directions, von_mises_of
from gradedesign.mechanics.material.local_stress_law import LocalStressLaw
from gradedesign.mechanics.material.strength_surface import StrengthSurface

DENSITY = np.array([0.1, 0.15, 0.2, 0.3, 0.5, 0.8])
MISES = np.diag([1.0, 1.0, 1.0, 3.0, 3.0, 3.0])
MISES[:3, :3] += -0.5 * (1 - np.eye(3))


NOT_KNOWN = np.zeros((2, 0))


def surface(form, percentile=99.5, distribution=NOT_KNOWN):
    return StrengthSurface(
        exponent=4, weights=np.ones(1), forms=form[None], symmetry="none",
        max_error=0.0, rms_error=0.0, unsafe_error=0.0, percentile=percentile,
        distribution=distribution,
    )  # fmt: skip


def scaled_mises(amplification):
    """A law whose local stress is the macroscopic von Mises stress times a factor per density."""
    return LocalStressLaw(
        density=DENSITY, surfaces=tuple(surface(a**2 * MISES) for a in amplification)
    )


def test_a_power_of_density_is_reproduced_between_the_surfaces():
    # In logarithms a power is a straight line, which monotone cubics reproduce exactly.
    law = scaled_mises(2.5 * DENSITY**-1.5)
    stress = spread_directions(40, np.random.default_rng(31))
    rho = np.random.default_rng(32).uniform(0.1, 0.8, 40)
    found = law.at(law.profile(stress), rho)
    np.testing.assert_allclose(found, 2.5 * rho**-1.5 * von_mises_of(stress), rtol=1e-12)
    permitted = 9.0
    least = law.least_density(law.profile(stress), permitted, (0.12, 0.7))
    exact = (permitted / 2.5 / von_mises_of(stress)) ** (-1 / 1.5)
    np.testing.assert_allclose(least, np.clip(exact, 0.12, 0.7), rtol=1e-9)
    assert 5 < ((exact > 0.12) & (exact < 0.7)).sum() < 40


@pytest.mark.parametrize("count", [2, 3, DENSITY.size])
def test_near_a_density_the_profile_gives_the_same_values_and_slopes(count):
    """Of the whole profile a cubic knows four values at most."""
    rng = np.random.default_rng(33)
    forms = [np.diag([*(r ** -rng.uniform(2.0, 4.0, 3)), 1.0, 1.0, 1.0]) for r in DENSITY[:count]]
    surfaces = tuple(surface(f + f.T) for f in forms)
    law = LocalStressLaw(density=DENSITY[:count], surfaces=surfaces)
    ends = DENSITY[0], DENSITY[count - 1]
    rho = np.concatenate([rng.uniform(*ends, 60), law.density])
    stress = rng.normal(size=(6, rho.size, 4))
    whole, near = (law.profile(stress, at).mean(axis=-1) for at in (None, rho))
    for one, other in zip(law.slopes(whole, rho), law.slopes(near, rho), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-300)
    assert (count < 5) or not np.array_equal(whole, near)


def test_surfaces_of_different_shape_meet_in_their_own_directions():
    # One direction strengthens faster with density than the other: each keeps its own power.
    forms = [np.diag([r**-3.0, r**-5.0, 0, 0, 0, 0]) for r in DENSITY]
    law = LocalStressLaw(density=DENSITY, surfaces=tuple(surface(f) for f in forms))
    profile = law.profile(np.eye(6)[:, :2])
    rho = np.array([0.23, 0.23])
    np.testing.assert_allclose(law.at(profile, rho), [0.23**-1.5, 0.23**-2.5], rtol=1e-12)


def test_no_density_above_the_answer_is_worse():
    # Local stress falls, rises between 0.2 and 0.3, and falls again.
    law = scaled_mises(np.array([9.0, 6.0, 4.0, 5.0, 3.0, 1.5]))
    for permitted in (2.0, 3.5, 4.5, 4.99, 5.5, 8.0):
        least = law.least_density(law.profile(np.eye(6)[:, :1]), permitted, (0.1, 0.8))[0]
        profile = np.repeat(law.profile(np.eye(6)[:, :1]), 2000, axis=1)
        # Oracle: every density of a fine grid, from the top down.
        grid = np.linspace(0.1, 0.8, 2000)
        too_much = np.flatnonzero(law.at(profile, grid) > permitted)
        assert grid[too_much[-1]] <= least <= grid[too_much[-1] + 1] + 1e-12


def test_ends_of_the_bounds():
    law = scaled_mises(DENSITY**-1.0)
    profile = law.profile(np.array([[1e-9, 3.0, 100.0, 0.0]]) * np.eye(6)[:, :1])
    found = law.least_density(profile, 10.0, (0.12, 0.6))
    np.testing.assert_allclose(found, [0.12, 0.3, 0.6, 0.12])
    assert law.at(profile, np.full(4, 0.8))[3] == 0.0


@pytest.mark.parametrize("rho", [0.09, 0.81, np.nan])
def test_outside_the_densities_is_an_error(rho):
    law = scaled_mises(DENSITY**-1.0)
    with pytest.raises(DensityError, match=r"0\.1 to 0\.8"):
        law.at(law.profile(np.eye(6)[:, :1]), np.array([rho]))
    with pytest.raises(DensityError):
        law.least_density(law.profile(np.eye(6)[:, :1]), 1.0, (0.2, 0.9))


def test_impossible_laws_are_refused():
    one, other = surface(MISES), surface(MISES, 99.0)
    with pytest.raises(ValueError, match="increasing"):
        LocalStressLaw(density=np.array([0.3, 0.2]), surfaces=(one, one))
    with pytest.raises(ValueError, match="percentile"):
        LocalStressLaw(density=np.array([0.2, 0.3]), surfaces=(one, other))
    with pytest.raises(ValueError, match="shape"):
        LocalStressLaw(density=np.array([0.2, 0.3]), surfaces=(one,))


def with_tails(*powers):
    """Cells in which half a per cent of the solid, over stress to a power, lies above."""
    stress = np.linspace(0.6, 1.5, 7)
    return LocalStressLaw(
        density=DENSITY[: len(powers)],
        surfaces=tuple(
            surface(MISES, distribution=np.stack([100 - 0.5 * stress**-p, stress])) for p in powers
        ),
    )


def test_volume_above_a_stress_follows_the_distribution():
    law = with_tails(4.0, 8.0)
    assert law.has_distribution
    assert not scaled_mises(DENSITY**-1.0).has_distribution
    stress = np.array([0.7, 1.0, 1.4, 3.0])
    for rho, power in ((0.1, 4.0), (np.sqrt(0.1 * 0.15), 6.0), (0.15, 8.0)):
        found = law.volume_slopes(stress, np.full(4, rho))[0]
        np.testing.assert_allclose(found, 0.005 * stress**-power, rtol=1e-9)
    # Below the lowest percentage known everything counts as stressed more.
    assert law.volume_slopes(np.array([0.1, 0.0]), np.full(2, 0.1))[0].tolist() == [1.0, 1.0]


def test_distributions_are_checked():
    for wrong in ([[50, 40], [0.5, 1]], [[50, 99], [1, 0.5]], [[50, 100], [0.5, 1]]):
        with pytest.raises(ValueError, match="increasing"):
            surface(MISES, distribution=np.array(wrong))
