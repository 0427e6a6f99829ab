"""The optimality step against problems with known optima."""

import numpy as np
import pytest

from gradedesign.mechanics.sizing.optimality import optimality_step


def _minimise(compliances, limits, cost, *, lower=1e-3, upper=1.0, power=1.5, steps=80):
    """Minimise cost . x subject to sum c / x**power <= limit, by repeated steps."""
    x = np.full(len(cost), 0.5)
    for _ in range(steps):
        values = np.array(
            [(c / x**power).sum() / b for c, b in zip(compliances, limits, strict=True)]
        )
        slopes = np.array(
            [-power * c / x ** (power + 1) / b for c, b in zip(compliances, limits, strict=True)]
        )
        low, high = np.maximum(lower, x * 0.7), np.minimum(upper, x * 1.3)
        x, _ = optimality_step(x, cost, values, slopes, low, high)
    return x


def test_one_constraint_has_the_closed_form():
    """Stationarity: x = (mu p c / v)^(1/(1+p)), mu from the active limit (closed form)."""
    rng = np.random.default_rng(311)
    c, v, p, b = rng.uniform(0.1, 2, 40), rng.uniform(0.5, 2, 40), 1.5, 400.0
    shape = (p * c / v) ** (1 / (1 + p))
    expected = shape * ((c / shape**p).sum() / b) ** (1 / p)
    got = _minimise([c], [b], v, lower=1e-4, upper=50.0)
    np.testing.assert_allclose(got, expected, rtol=1e-5)


def test_bounds_hold_and_the_limit_is_used_exactly():
    c = np.linspace(0.01, 1.0, 30)
    v = np.ones(30)
    got = _minimise([c], [60.0], v, lower=0.3, upper=0.6)
    assert got.min() >= 0.3
    assert got.max() <= 0.6
    assert np.isclose((c / got**1.5).sum(), 60.0, rtol=1e-6)


def test_a_slack_constraint_changes_nothing():
    c, v = np.linspace(0.1, 1.0, 20), np.ones(20)
    one = _minimise([c], [60.0], v)
    two = _minimise([c, c[::-1]], [60.0, 1e4], v)
    np.testing.assert_allclose(one, two, rtol=1e-6)


def test_two_constraints_are_both_met_and_symmetric():
    c, v = np.linspace(0.1, 1.0, 20), np.ones(20)
    x = _minimise([c, c[::-1]], [40.0, 40.0], v)
    np.testing.assert_allclose(x, x[::-1], rtol=1e-3)
    assert (c / x**1.5).sum() <= 40.0 * (1 + 1e-6)
    assert (c[::-1] / x**1.5).sum() <= 40.0 * (1 + 1e-6)


def test_a_gradient_that_hurts_lowers_the_variable():
    """With one variable's density raising the constraint, that variable falls to its bound."""
    x, low, high = np.full(3, 0.5), np.full(3, 0.1), np.full(3, 1.0)
    gradients = np.array([[-1.0, -1.0, 0.8]])
    new, mu = optimality_step(x, np.ones(3), np.array([1.2]), gradients, low, high)
    assert mu[0] > 0
    assert new[2] == low[2]
    expanded = 1.2 + (0.5 / 1.5) * ((x[:2] / new[:2]) ** 1.5 - 1).sum() + 0.8 * (new[2] - 0.5)
    assert np.isclose(expanded, 1.0, rtol=1e-7)


def _coordinates_in_turn(x, cost, values, gradients, lower, upper, *, exponent=1.5, sweeps=3000):
    """The same dual problem by bisection of one multiplier after the other: slow and clear."""
    helping = np.where(gradients < 0, -gradients * x / exponent, 0.0)
    hurting = np.where(gradients > 0, gradients, 0.0)
    unit = cost / (cost @ x)

    def primal(mu):
        gain = exponent * (mu @ helping) / x
        raised = x * (gain / (unit + mu @ hurting)) ** (1 / (1 + exponent))
        return np.clip(raised, lower, upper)

    def excess(mu, j):
        new = primal(mu)
        return values[j] + helping[j] @ ((x / new) ** exponent - 1) + hurting[j] @ (new - x) - 1

    mu = np.zeros(len(values))
    for _ in range(sweeps):
        before = mu.copy()
        for j in range(len(mu)):
            low, high = -45.0, 25.0
            for _ in range(60):
                middle = 0.5 * (low + high)
                mu[j] = np.exp(middle)
                low, high = (middle, high) if excess(mu, j) > 0 else (low, middle)
            mu[j] = 0.0 if high < -44.9 else np.exp(high)
        if np.allclose(mu, before, rtol=1e-10, atol=1e-15):
            break
    return primal(mu)


@pytest.mark.parametrize("seed", range(5))
def test_nearly_parallel_gradients_end_where_coordinates_in_turn_end(seed):
    """Constraints whose gradients differ by a tenth, where coordinates in turn creep.

    The oracle stops at a relative change of 1e-10 of its multipliers a sweep; with the error of a
    sweep falling by a factor of 0.99 or less, they are 1e-8 from the solution.
    """
    rng = np.random.default_rng(seed)
    n = 30
    base = rng.uniform(0.01, 0.1, n)
    gradients = -np.array([base * (1 + 0.1 * rng.normal(size=n)) for _ in range(3)])
    gradients[:, ::7] *= -0.2
    values = 1.0 + rng.uniform(-0.08, 0.08, 3)
    x, cost = rng.uniform(0.2, 0.8, n), rng.uniform(0.5, 2.0, n)
    problem = (x, cost, values, gradients, 0.7 * x, 1.3 * x)
    np.testing.assert_allclose(
        optimality_step(*problem)[0], _coordinates_in_turn(*problem), rtol=1e-6
    )


def test_a_limit_out_of_reach_moves_what_helps_as_far_as_it_may():
    x, low, high = np.full(4, 0.5), np.full(4, 0.4), np.full(4, 0.6)
    gradients = np.array([[-1.0, -1.0, -1.0, 0.5], [-0.1, -0.1, -0.1, 0.0]])
    new, _ = optimality_step(x, np.ones(4), np.array([9.0, 1.001]), gradients, low, high)
    assert np.array_equal(new, [0.6, 0.6, 0.6, 0.4])
