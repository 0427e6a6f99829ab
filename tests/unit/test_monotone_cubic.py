"""Monotone cubics against scipy's, and their derivatives against differences."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from gradedesign.mechanics.material.monotone_cubic import cubic_derivatives

STEP = 1e-6


def curves(count, n, seed):
    rng = np.random.default_rng(seed)
    knots = np.cumsum(rng.uniform(0.2, 1.0, count))
    values = rng.normal(size=(count, n))
    # Half of the curves rise, as laws do; the others turn, which flattens them at their knots.
    values[:, ::2] = np.sort(values[:, ::2], axis=0)
    return knots, values, rng.uniform(knots[0], knots[-1], n)


@pytest.mark.parametrize("count", [2, 3, 5, 9])
def test_values_are_those_of_scipy(count):
    knots, values, x = curves(count, 200, 11)
    x[:2] = knots[0], knots[-1]
    expected = [PchipInterpolator(knots, values[:, j])(x[j]) for j in range(x.size)]
    slopes = [PchipInterpolator(knots, values[:, j])(x[j], 1) for j in range(x.size)]
    value, by_place, _ = cubic_derivatives(knots, values, x)
    # Rounding of some ten operations on numbers of order 1 to 10.
    np.testing.assert_allclose(value, expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(by_place, slopes, rtol=0, atol=1e-11)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_derivatives_by_values_are_those_of_differences(count):
    knots, values, x = curves(count, 300, 12)
    _, _, by_value = cubic_derivatives(knots, values, x)
    for k in range(count):
        ends = []
        for sign in (1.0, -1.0):
            moved = values.copy()
            moved[k] += sign * STEP
            ends.append(cubic_derivatives(knots, moved, x)[0])
        found = (ends[0] - ends[1]) / (2 * STEP)
        # Second derivatives of order 10 times the step; a secant that changes sign would be worse.
        np.testing.assert_allclose(by_value[k], found, rtol=0, atol=1e-5)
