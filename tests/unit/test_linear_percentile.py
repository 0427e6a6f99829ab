"""Percentile by volume of a field that is linear in every tetrahedron."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gradedesign.mechanics.fe.linear_percentile import linear_percentile, share_below


def barycentric(rng, count):
    """Points spread evenly over a tetrahedron, ``(4, count)``."""
    return rng.dirichlet(np.ones(4), size=count).T


@pytest.mark.parametrize(
    "corners",
    [
        (0, 1, 2, 3),
        (0, 0, 2, 3),
        (0, 2, 2, 3),
        (0, 1, 3, 3),
        (0, 0, 0, 1),
        (0, 1, 1, 1),
        (0, 0, 1, 1),
    ],
)
def test_share_below_a_level_is_that_of_points(corners):
    values = np.array(corners, float)
    points = barycentric(np.random.default_rng(31), 200_000)
    for level in (0.2, 0.5, 0.9, 1.0, 1.4, 2.0, 2.6):
        share = share_below(values[:, None], level)[0]
        # Three standard deviations of a share by 200,000 points.
        assert share == pytest.approx(float((values @ points <= level).mean()), abs=0.0034)


def test_equal_corners_are_below_at_once():
    assert linear_percentile(np.full((4, 3), 7.0), np.ones(3), 50.0) == pytest.approx(7.0)
    assert share_below(np.full((4, 1), 7.0), 7.0)[0] == 1.0
    assert share_below(np.full((4, 1), 7.0), 6.9)[0] == 0.0


@given(
    st.lists(
        st.tuples(*[st.floats(0, 100) for _ in range(4)], st.floats(0.01, 10)),
        min_size=1,
        max_size=6,
    ),
    st.floats(1, 99.9),
)
def test_the_stated_share_lies_below(pieces, percentile):
    data = np.array(pieces)
    values, volumes = data[:, :4].T, data[:, 4]
    found = linear_percentile(values, volumes, percentile)
    corners = np.sort(values, axis=0)
    step = 1e-6 * max(values.max(), 1e-9)
    wanted = percentile / 100 * volumes.sum()
    assert volumes @ share_below(corners, found + step) >= wanted * (1 - 1e-9)
    assert volumes @ share_below(corners, found - step) <= wanted * (1 + 1e-9)


def test_parts_of_volume_count_and_the_hundredth_is_the_largest():
    values = np.array([[0.0, 5.0], [1.0, 6.0], [2.0, 7.0], [3.0, 9.0]])
    alone = linear_percentile(values[:, :1], np.ones(1), 80.0)
    assert linear_percentile(values, np.array([1.0, 0.0]), 80.0) == pytest.approx(alone)
    assert linear_percentile(values, np.array([1.0, 1e-3]), 100.0) == 9.0


@pytest.mark.parametrize(
    ("values", "volumes", "percentile"),
    [
        (np.ones((4, 2)), np.ones(3), 50.0),
        (np.full((4, 1), np.nan), np.ones(1), 50.0),
        (np.ones((4, 1)), -np.ones(1), 50.0),
        (np.ones((4, 1)), np.zeros(1), 50.0),
        (np.ones((4, 1)), np.ones(1), 0.0),
        (np.ones((4, 1)), np.ones(1), 101.0),
    ],
)
def test_what_has_no_percentile_is_refused(values, volumes, percentile):
    with pytest.raises(ValueError, match="expected"):
        linear_percentile(values, volumes, percentile)
