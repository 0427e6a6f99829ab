"""Stress above yield is told, and a limit that judges too little does not hold."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from small_parts import zone_of

from gradedesign.design.loop.ended import Ended
from gradedesign.design.verdict.reasons import why_not
from gradedesign.errors import SolverError
from gradedesign.mechanics.explicit.support_zones import undisturbed_at
from gradedesign.mechanics.explicit.yielding import yielding, yielding_words
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.local_stress import StressLimit
from gradedesign.mechanics.limits.row import LEAST_JUDGED, LimitRow
from gradedesign.mechanics.limits.verdict import all_hold, limit_rows

ROW = LimitRow(
    key=LimitKey(kind="stress", region="lattice"), name="stress in lattice", load_case="pull",
    value=40.0, limit=50.0, unit="MPa", judged_by="explicit analysis",
)  # fmt: skip


def bar(peak):
    """A bar of 10 mm with 100 MPa at its support, 10 MPa elsewhere and a peak at 7.5 mm."""
    points = np.array([np.arange(0.5, 10.0), np.zeros(10), np.zeros(10)])
    stress = np.full((10, 2), 10.0)
    stress[0], stress[7, 1] = 100.0, peak
    return points, np.ones(10), {"rest": 0.1 * stress, "pull": stress}


def test_stress_above_yield_away_from_supports_is_told_with_share_and_place():
    points, volumes, stress = bar(peak=60.0)
    # A case may state a wider radius: what its support disturbs stays the same.
    free = undisturbed_at(points, [zone_of(lambda p: p[0], 9.0, disturbed=1.0)])
    found = yielding(points, volumes, stress, free, 50.0)
    assert (found.load_case, found.largest, found.place) == ("pull", 60.0, (7.5, 0.0, 0.0))
    assert found.share == pytest.approx(0.5 / 9)
    (words,) = yielding_words(found, "the printed solid", limited=False)
    assert "5.56% of its volume" in words
    assert "60 MPa at (7.5, 0.0, 0.0) mm; no limit of stress judges this case" in words
    assert yielding(points, volumes, stress, free, 60.0) is None
    assert yielding(points, volumes, stress, np.ones(10, bool), 60.0).largest == 100.0
    assert yielding_words(None, "the printed solid", limited=True) == ()


def test_a_row_that_judges_too_little_does_not_hold_and_says_why():
    assert all_hold([ROW, replace(ROW, judged=LEAST_JUDGED)])
    little = replace(ROW, judged=0.43)
    assert not all_hold([ROW, little])
    assert (ROW.word, little.word, replace(ROW, value=60.0).word) == ("holds", "UNJUDGED", "BROKEN")
    words = why_not([ROW, little], Ended(by="iterations", words="iterations are used up"))
    assert "judged on 43% of its volume, less than the 50%" in words
    assert "iterations are used up" in words


def test_a_limit_without_a_value_is_an_error_and_not_met():
    limit = StressLimit(
        key=ROW.key, name=ROW.name, allowed=50.0, percentile=99.0, evaluated=np.zeros(3, bool)
    )

    nothing = SimpleNamespace(measures={"pull": ()}, judged_share=0.0)
    with pytest.raises(SolverError, match="stress in lattice has no value by explicit analysis"):
        limit_rows([limit], nothing, "explicit analysis")
