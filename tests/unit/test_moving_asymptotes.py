"""The method of moving asymptotes on problems whose solutions are published or known."""

import numpy as np
import pytest
from scipy.optimize import linprog

from gradedesign.mechanics.sizing.moving_asymptotes import (
    asymptotes_step,
    first_asymptotes,
    moved_asymptotes,
)


def minimised(x, lower, upper, evaluate, steps):
    """Variables after some steps; ``evaluate`` gives cost, values and gradients."""
    asymptotes = first_asymptotes(x, lower, upper)
    for _ in range(steps):
        step = asymptotes_step(x, *evaluate(x), (lower, upper), asymptotes.distance)
        assert (step.x >= lower).all()
        assert (step.x <= upper).all()
        x = step.x
        asymptotes = moved_asymptotes(asymptotes, x, lower, upper)
    return x


def test_svanbergs_cantilever():
    """Svanberg 1987, section 5: weight 1.340 at (6.016, 5.309, 4.494, 3.502, 2.153)."""
    c = np.array([61.0, 37.0, 19.0, 7.0, 1.0])

    def evaluate(x):
        value = (c / x**3).sum() - 1.0
        return np.full(5, 0.0624), np.array([value]), (-3.0 * c / x**4)[None]

    x = minimised(np.full(5, 5.0), np.full(5, 1.0), np.full(5, 10.0), evaluate, 20)
    assert 0.0624 * x.sum() == pytest.approx(1.340, abs=5e-4)
    np.testing.assert_allclose(x, [6.016, 5.309, 4.494, 3.502, 2.153], atol=1.2e-3)
    assert evaluate(x)[1][0] == pytest.approx(0.0, abs=1e-7)


def test_many_variables_of_a_power_law():
    """Least sum of v x where sum of w x^-n is at most 1: x = (n mu w / v)^(1 / (n + 1))."""
    rng = np.random.default_rng(77)
    n, power = 4000, 1.7
    w, v = rng.uniform(0.5, 2.0, (2, n)) / n

    def evaluate(x):
        sums = w @ x**-power
        gradient = -power * w * x ** (-power - 1) / sums
        return v, np.array([np.log(sums)]), gradient[None]

    x = minimised(np.full(n, 3.0), np.full(n, 0.2), np.full(n, 6.0), evaluate, 30)
    exact = (w / v) ** (1 / (power + 1))
    exact *= (w @ exact**-power) ** (1 / power)
    assert 0.2 < exact.min() < exact.max() < 6.0
    # Thirty steps leave 1e-6 of the mass, its square root of the variables.
    assert v @ x == pytest.approx(v @ exact, rel=1e-6)
    np.testing.assert_allclose(x, exact, rtol=2e-3)


def test_several_constraints_and_bounds_end_where_a_linear_programme_does():
    rng = np.random.default_rng(78)
    a, cost = rng.uniform(0.1, 1.0, (3, 12)), rng.uniform(0.5, 1.0, 12) / 12
    need = np.array([2.5, 3.0, 2.0])
    exact = linprog(cost, A_ub=-a, b_ub=-need, bounds=(0.1, 1.0))
    assert exact.status == 0
    x = minimised(
        np.full(12, 0.5), np.full(12, 0.1), np.full(12, 1.0),
        lambda x: (cost, need - a @ x, -a), 80,
    )  # fmt: skip
    assert cost @ x == pytest.approx(exact.fun, rel=1e-4)
    assert (need - a @ x).max() < 1e-6


def test_what_cannot_be_held_goes_as_far_as_it_can():
    x = minimised(
        np.full(3, 0.4), np.full(3, 0.1), np.full(3, 0.6),
        lambda x: (np.full(3, 1 / 3), np.array([2.0 - x.sum()]), np.full((1, 3), -1.0)), 12,
    )  # fmt: skip
    np.testing.assert_allclose(x, 0.6, atol=1e-6)


def test_without_limits_all_end_at_their_lower_bounds():
    x = minimised(
        np.full(3, 0.4), np.full(3, 0.1), np.full(3, 0.6),
        lambda _: (np.full(3, 1 / 3), np.zeros(0), np.zeros((0, 3))), 12,
    )  # fmt: skip
    np.testing.assert_allclose(x, 0.1, atol=1e-6)


def test_asymptotes_draw_together_where_a_variable_turns():
    low, high = np.full(3, 0.1), np.full(3, 10.0)
    asymptotes = first_asymptotes(np.ones(3), low, high)
    for x in ([2.0, 2.0, 2.0], [1.0, 3.0, 2.0]):
        asymptotes = moved_asymptotes(asymptotes, np.array(x), low, high)
    # Svanberg 1987, section 4: 0.7 of the distance where steps alternate, 1.2 where they do not.
    np.testing.assert_allclose(asymptotes.distance, np.log(10.0) * np.array([0.7, 1.2, 1.0]))
