"""Stress measures by phase and neighbourhood."""

import numpy as np
import pytest

from gradedesign.verify.measures import stress_measures, worst_neighbourhood


def _cloud(count=4000):
    rng = np.random.default_rng(5117)
    return rng.uniform(0, 40, (3, count)), rng.uniform(0.5, 1.5, count), rng


def test_phases_are_measured_apart():
    points, volumes, _ = _cloud()
    phase = np.where(points[0] < 20, 0, 2)
    stress = np.repeat(np.where(phase == 0, 10.0, 30.0)[:, None], 4, axis=1)
    measures = stress_measures(
        points,
        volumes,
        stress,
        phase,
        np.ones(len(volumes), bool),
        limit=20.0,
        percentile=99.5,
        cell_size=10.0,
    )
    assert [m.phase for m in measures] == ["lattice", "kept"]
    assert [m.value for m in measures] == [10.0, 30.0]
    assert [m.share_above for m in measures] == [0.0, 1.0]
    assert sum(m.volume for m in measures) == pytest.approx(volumes.sum())


def test_excluded_elements_do_not_count():
    points, volumes, _ = _cloud()
    stress = np.where(points[0] < 5, 1e6, 1.0)[:, None] * np.ones(4)
    measures = stress_measures(
        points,
        volumes,
        stress,
        np.zeros(len(volumes), int),
        points[0] >= 5,
        limit=2.0,
        percentile=99.5,
        cell_size=10.0,
    )
    assert measures[0].maximum == 1.0


def test_half_a_per_cent_cannot_hide_a_failing_cell():
    """One hot cell of 64: the percentile misses most of it, the neighbourhood does not."""
    points, volumes, _ = _cloud(20000)
    hot = np.all(np.abs(points - np.array([[25.0], [35.0], [15.0]])) < 2.0, axis=0)
    assert hot.sum() / hot.size < 0.005
    stress = np.where(hot, 100.0, 1.0)[:, None] * np.ones(4)
    value, centre = worst_neighbourhood(points, volumes, stress, 99.5, 10.0)
    assert value == 100.0
    assert np.abs(np.subtract(centre, (25.0, 35.0, 15.0))).max() <= 5.0
    measure = stress_measures(
        points,
        volumes,
        stress,
        np.zeros(len(volumes), int),
        np.ones(len(volumes), bool),
        limit=50.0,
        percentile=99.5,
        cell_size=10.0,
    )[0]
    assert measure.value == 1.0
    assert measure.worst_cell == 100.0


def test_slivers_at_the_border_are_no_neighbourhood():
    points, volumes, _ = _cloud(8000)
    points[:, 0] = 49.0  # alone in its own cube
    stress = np.ones((8000, 4))
    stress[0] = 500.0
    value, _ = worst_neighbourhood(points, volumes, stress, 99.5, 10.0)
    assert value == 1.0
