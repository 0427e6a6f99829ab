"""Random spheres; expected numbers are probabilities of independent points."""

import numpy as np
import pytest

from gradedesign_cells_stochastic.random_points import random_points
from gradedesign_cells_stochastic.random_spheres import PERIOD, random_pores, random_spheres

STEP = 1.2207440846057596 ** -np.arange(1.0, 4.0)
POINTS = PERIOD * np.mod(0.4142 + STEP[:, None] * np.arange(30_000), 1.0)
SEEDS = [float(s) for s in range(300, 308)]


def test_balls_fill_what_independent_points_leave():
    # A place is free of n balls of volume V in the window W with probability (1 - V / W)^n, about
    # exp(-n V / W); n / W is 1. Within four standard errors of the mean over seeds.
    away = np.stack([random_spheres(POINTS, seed=s) for s in SEEDS])
    for radius in (0.3, 0.5, 0.7):
        volume = 4 / 3 * np.pi * radius**3
        filled = np.mean(away <= radius, axis=1)
        error = np.std(filled, ddof=1) / len(SEEDS) ** 0.5
        assert error < 0.01
        exact = 1 - (1 - volume / PERIOD**3) ** PERIOD**3
        assert exact == pytest.approx(1 - np.exp(-volume), abs=2e-3)
        assert np.mean(filled) == pytest.approx(exact, abs=4 * error)


def test_pores_are_what_balls_leave():
    balls = random_spheres(POINTS, seed=300.0, least_distance=0.5)
    pores = random_pores(POINTS, seed=300.0, least_distance=0.5)
    np.testing.assert_array_equal(pores, -balls)


def test_balls_apart_fill_their_volume_exactly():
    # Centres 0.7 apart: balls of radius 0.35 do not overlap.
    filled = np.mean(random_spheres(POINTS, seed=300.0, least_distance=0.7) <= 0.35)
    assert filled == pytest.approx(4 / 3 * np.pi * 0.35**3, abs=0.003)


def test_distance_is_that_of_the_nearest_copy():
    centres = random_points(300.0, PERIOD, 0.0)
    u = np.random.default_rng(305).uniform(-7, 13, (3, 200))
    apart = u.T[:, None] - centres
    apart -= PERIOD * np.round(apart / PERIOD)
    nearest = np.linalg.norm(apart, axis=2).min(axis=1)
    np.testing.assert_allclose(random_spheres(u, seed=300.0), nearest, atol=1e-12)
