"""The use of the limits that a sizing aims at."""

from types import SimpleNamespace

import pytest

from gradedesign.design.loop.iteration import MOST_ROOM, aim_of
from gradedesign.design.loop.iteration_steps import TARGET
from gradedesign.mechanics.explicit.correction import Discrepancy
from gradedesign.mechanics.limits.key import LimitKey

KEY, OTHER = LimitKey(kind="displacement"), LimitKey(kind="displacement", region="other")


def finished(*iterations):
    return [
        SimpleNamespace(
            summary=SimpleNamespace(passed=passed),
            discrepancy=Discrepancy(values=((OTHER, 0.9), (KEY, discrepancy)), governing=KEY),
        )
        for passed, discrepancy in iterations
    ]


def test_early_rounds_and_designs_that_hold_aim_just_below_the_limit():
    assert aim_of([]) == aim_of(finished((False, 0.5), (False, 0.1))) == TARGET
    assert aim_of(finished((False, 0.5), (False, 0.1), (True, 0.05))) == TARGET


def test_a_miss_that_comes_again_leaves_the_room_that_predictions_are_off_by():
    missed = finished((False, 0.5), (False, 0.1), (False, -0.04))
    assert aim_of(missed) == pytest.approx(0.96 * TARGET)
    far = finished((False, 0.5), (False, 0.1), (False, 0.3))
    assert aim_of(far) == pytest.approx((1 - MOST_ROOM) * TARGET)


def test_without_limits_by_gradient_the_gap_of_the_others_counts():
    missed = [
        SimpleNamespace(
            summary=SimpleNamespace(passed=False), discrepancy=Discrepancy(values=((KEY, -0.05),))
        )
    ] * 3
    assert aim_of(missed) == pytest.approx(0.95 * TARGET)
