"""Slabs must give the same values as one evaluation of the whole grid."""

import numpy as np
import pytest

from gradedesign.errors import LatticeError
from gradedesign.geometry.contour.sample import grid_points, sample_slabs

LOWER = np.array([-1.0, 2.0, 0.5])


def wavy(points):
    x, y, z = points
    return np.sin(3 * x) * y - z**2 + x


def test_grid_points_are_the_nodes():
    points = grid_points(LOWER, (1, 0, 2), (2, 3, 4), 0.25)
    assert points.shape == (3, 2, 3, 4)
    np.testing.assert_array_equal(points[:, 1, 2, 3], LOWER + 0.25 * np.array([2, 2, 5]))


def sample_grid(field, lower, shape, h, nodes=1000):
    """Field on the whole grid, put together from its slabs."""
    grid = np.full(shape, np.nan)
    for piece in sample_slabs(field, lower, shape, h, nodes=nodes):
        window = slice(piece.first, piece.first + len(piece.values))
        grid[window] = piece.values
    return grid


@pytest.mark.parametrize("nodes", [1, 144, 300, 10_000])
def test_grid_equals_one_evaluation(nodes):
    shape = (9, 6, 12)
    whole = wavy(grid_points(LOWER, (0, 0, 0), shape, 0.2))
    np.testing.assert_array_equal(sample_grid(wavy, LOWER, shape, 0.2, nodes=nodes), whole)


def test_every_node_is_evaluated_once_and_shared():
    """A field that counts its own calls gives neighbours the same number at shared nodes."""
    calls = []

    def counting(points):
        first = sum(calls)
        calls.append(points[0].size)
        return first + np.arange(points[0].size, dtype=float).reshape(points.shape[1:])

    shape, seen = (9, 8, 7), np.full((9, 8, 7), np.nan)
    for piece in sample_slabs(counting, LOWER, shape, 0.2, nodes=120):
        window = slice(piece.first, piece.first + len(piece.values))
        known = ~np.isnan(seen[window])
        np.testing.assert_array_equal(seen[window][known], piece.values[known])
        seen[window] = piece.values
    assert sum(calls) == 9 * 8 * 7
    np.testing.assert_array_equal(np.sort(seen.ravel()), np.arange(9 * 8 * 7))


def test_values_that_are_not_finite_are_refused():
    with pytest.raises(LatticeError, match="not finite at 1 of 27 points"):
        sample_grid(
            lambda p: np.where((p == 1.0).all(axis=0), np.nan, 1.0), np.zeros(3), (3, 3, 3), 1.0
        )


def test_wrong_shape_is_refused():
    with pytest.raises(LatticeError, match="returned shape"):
        sample_grid(lambda p: p, np.zeros(3), (3, 3, 3), 1.0)


@pytest.mark.parametrize(("shape", "h"), [((1, 3, 3), 1.0), ((3, 3, 3), 0.0)])
def test_empty_grid_is_refused(shape, h):
    with pytest.raises(LatticeError, match="at least 2 nodes"):
        sample_grid(wavy, LOWER, shape, h)
