"""The optimality step against problems with known optima."""

import numpy as np

from gradedesign.sizing.optimality import optimality_step


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
