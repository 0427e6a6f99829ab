"""Steps of sizing that come out worse than approximated are taken back and made shorter."""

from types import SimpleNamespace

import numpy as np
import pytest

from gradedesign.mechanics.sizing import next_design as module
from gradedesign.mechanics.sizing.moving_asymptotes import asymptotes_step
from gradedesign.mechanics.sizing.next_design import Approximation, next_design

BOUNDS = np.full(3, 0.05), np.full(3, 1.0)
DISTANCE = np.full(3, 0.5 * np.log(20.0))


def far_step(power):
    """Logarithm of the use of one limit whose members are lost, all but at once, below 0.5."""
    return lambda x: -np.log((x**power / (x**power + 0.5**power)).mean()) + np.log(0.8)


def approximation(value, x):
    step = 1e-6
    slopes = [(value(x + step * unit) - value(x - step * unit)) / (2 * step) for unit in np.eye(3)]
    return Approximation(
        x=x, cost=np.full(3, 1.0 / x.sum()), limit=np.zeros(1, dtype=np.int64),
        values=np.array([value(x)]), gradients=np.array([slopes]),
    )  # fmt: skip


def followed(monkeypatch, value, x, curvature=1.0, place=0, more=0.0):
    """The next design by a limit of known value, and the designs that were solved for it."""
    tried = []

    def solved(problem, new, recent):
        used = np.full(2, 1e-3)
        used[place] = problem.target * np.exp(value(new) + more)
        tried.append(new.copy())
        return SimpleNamespace(utilisations=tuple(used))

    monkeypatch.setattr(module, "solved_design", solved)
    new, _, left = next_design(
        SimpleNamespace(target=0.985), approximation(value, x), DISTANCE, BOUNDS, 1.0,
        np.array([curvature, 1.0]), None,
    )  # fmt: skip
    return new, left, tried


def test_a_design_that_passes_its_limit_is_taken_back(monkeypatch):
    value, x = far_step(9.0), np.array([0.7, 0.72, 0.74])
    assert value(x) < 0.0
    plain = asymptotes_step(
        x, np.full(3, 1.0 / x.sum()), *(getattr(approximation(value, x), name) for name in
        ("values", "gradients")), BOUNDS, DISTANCE, move=1.0,
    )  # fmt: skip
    assert value(plain.x) > 0.3
    new, left, tried = followed(monkeypatch, value, x)
    np.testing.assert_array_equal(tried[0], plain.x)
    assert 1 < len(tried) < module._TRIALS
    assert value(new) <= module._BEYOND
    assert new.sum() < x.sum()
    # With the curvature that is left the next step begins as carefully.
    assert left[0] > 1.0
    assert left[1] == 1.0


def test_the_curvature_makes_the_approximation_say_what_was_found(monkeypatch):
    """Svanberg 2002, section 4: with it, but for a tenth, the design taken back is no surprise."""
    value, x = far_step(9.0), np.array([0.7, 0.72, 0.74])
    near, monkey = approximation(value, x), module._raised
    raised = []
    monkeypatch.setattr(
        module, "_raised", lambda *given: raised.append((given, monkey(*given))) or raised[-1][1]
    )
    followed(monkeypatch, value, x)
    (_, step, found, _, before), after = raised[0]
    needed = after[0] / module._STEEPER - before[0]
    assert step.expected[0] + needed * step.bend[0] == pytest.approx(found[0], rel=1e-9)
    # The same by the step's own sums: p and q of the greater curvature at the same place.
    move = np.log(step.x / x)
    slopes = near.gradients[0] * x
    extent = np.log(BOUNDS[1] / BOUNDS[0])
    floor = 0.01 * (np.abs(slopes) * extent).mean() / extent * (1.0 + needed)
    both = (
        DISTANCE**2 * (np.maximum(sign * slopes, 0) + 1e-3 * np.abs(slopes) + floor)
        for sign in (1, -1)
    )
    said = value(x) + sum(
        (each * (1 / (DISTANCE - sign * move) - 1 / DISTANCE)).sum()
        for sign, each in zip((1, -1), both, strict=True)
    )
    assert said == pytest.approx(found[0], rel=1e-6)


def test_a_design_as_expected_is_kept_at_once(monkeypatch):
    """A power law is a straight line in logarithms; what is left of an earlier curvature eases."""
    new, left, tried = followed(
        monkeypatch, lambda x: -1.5 * np.log(x).mean() - 0.8, np.array([0.7, 0.72, 0.74]), 10.0
    )
    assert len(tried) == 1
    assert left[0] == pytest.approx(10.0 * module._EASED)
    np.testing.assert_array_equal(new, tried[0])


def test_a_limit_out_of_reach_that_jumps_has_no_approximation_to_mend(monkeypatch):
    """It is in reach in the next iteration; to solve the same design again would find the same."""
    value = far_step(9.0)
    _, left, tried = followed(monkeypatch, value, np.array([0.7, 0.72, 0.74]), place=1)
    assert len(tried) == 1
    assert left.tolist() == [1.0, 1.0]


def test_what_cannot_be_held_is_solved_once(monkeypatch):
    """With all variables at their upper bounds there is no step to make shorter."""
    _, left, tried = followed(
        monkeypatch, lambda x: 1.0 - np.log(x).mean(), BOUNDS[1].copy(), more=0.1
    )
    assert len(tried) == 1
    assert left.tolist() == [1.0, 1.0]
    # Where it hardly comes nearer as approximated, what the solver leaves is no reason either.
    _, _, tried = followed(
        monkeypatch, lambda x: 1.0 - np.log(x).mean(), np.full(3, 0.99), more=0.02
    )
    assert len(tried) == 1


def test_a_design_better_than_approximated_is_kept_however_bad(monkeypatch):
    """Where limits contradict each other one may be expected to grow: that is no surprise."""
    rising = Approximation(
        x=np.full(3, 0.7), cost=np.full(3, 1.0 / 2.1), limit=np.array([0, 1]),
        values=np.array([0.2, 3.0]), gradients=np.array([np.full(3, 0.6), np.full(3, -2.0)]),
    )  # fmt: skip
    tried = []

    def solved(problem, new, recent):
        tried.append(new.copy())
        grown = 0.2 + 0.9 * (np.log(new / 0.7) * 0.42).sum()
        return SimpleNamespace(utilisations=tuple(0.985 * np.exp([grown, 2.0])))

    monkeypatch.setattr(module, "solved_design", solved)
    _, _, left = next_design(
        SimpleNamespace(target=0.985), rising, DISTANCE, BOUNDS, 1.0, np.ones(2), None
    )
    assert tried[0].min() > 0.7
    assert len(tried) == 1
    assert (left >= 1.0).all()
