"""Cells within a tolerance of size and angles."""

import numpy as np
import pytest

from gradedesign.geometry.maps import size_law
from gradedesign.geometry.maps.map_report import map_report, volume_points
from gradedesign.geometry.maps.phase_fields import graded_size_map

LOWER, UPPER = np.zeros(3), np.array([300.0, 100.0, 60.0])
POINTS = volume_points(None, LOWER, UPPER, 8000)


def bump(points):
    """Cells of 40 mm in the middle of one side and 50 mm elsewhere: no map has exactly these."""
    away = ((points[0] - 150) / 60) ** 2 + ((points[1] - 100) / 50) ** 2
    return 50 - 10 * np.exp(-away)


def report(size_of):
    made = graded_size_map(size_of, LOWER, UPPER, spacing=10.0)
    return map_report(made, POINTS, wanted=size_of)


def test_sizes_are_kept_better_for_a_little_shear(monkeypatch):
    after = report(bump)
    monkeypatch.setattr(size_law, "NEAR_SHARE", 2.0)
    before = report(bump)
    assert before.size_error.within_5 < after.size_error.within_5 - 0.02
    assert after.size_error.within_10 >= before.size_error.within_10
    assert after.folds == 0
    assert after.shear.p95 < 3.0


def test_a_size_that_can_be_had_exactly_stays_exact():
    found = report(lambda p: np.full(p.shape[1:], 45.0))
    assert found.size.least == pytest.approx(45)
    assert found.size.most == pytest.approx(45)
    assert found.shear.most == pytest.approx(0, abs=1e-5)


def test_sizes_that_no_map_follows_are_left_as_they_are(monkeypatch):
    def wide(points):
        return 25 + 75 * np.clip(points[1] / 100, 0, 1)

    after = report(wide)
    monkeypatch.setattr(size_law, "NEAR_SHARE", 2.0)
    assert report(wide) == after


def test_rows_within_the_tolerances_are_not_moved():
    rng = np.random.default_rng(907)
    near = np.eye(3) * rng.uniform(0.985, 1.015, (50, 3, 1)) + rng.uniform(-5e-3, 5e-3, (50, 3, 3))
    frame = np.repeat(np.eye(3)[None], 50, 0)
    np.testing.assert_allclose(size_law._allowed(near, frame), near, atol=1e-12)
    far = size_law._allowed(1.2 * near, frame)
    np.testing.assert_allclose(np.linalg.norm(far, axis=-1), 1 / 0.98)
