"""Several cells in one lattice, against the definition evaluated pair by pair without tables."""

import numpy as np
import pytest

from gradedesign.errors import DensityError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import Cells, cell_pair, largest_two, row_weights, single
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.shape import spread_points

SHIFTS = ((0.0, 0.0, 0.0), (0.25, 0.25, 0.25), (0.5, 0.0, 0.25))
POINTS = np.random.default_rng(7).uniform(-2, 3, (3, 4000))


def waves(u):
    return np.cos(2 * np.pi * u).sum(axis=0)


def spirals(u):
    x, y, z = 2 * np.pi * u
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def bars(u):
    away = np.abs(u - np.round(u))
    return np.minimum.reduce([np.hypot(away[i], away[i - 1]) for i in range(3)])


def sheet(name, f):
    return calibrate(CellFamily(name=name, shape=lambda u: np.abs(f(u)), sides=2, signed=f))


@pytest.fixture(scope="module")
def three():
    """Two sheets and struts; the last two do not meet."""
    members = (
        sheet("waves", waves),
        sheet("spirals", spirals),
        calibrate(CellFamily(name="bars", shape=bars, distance=True)),
    )
    blends = {
        (0, n): cell_pair(members[0], members[n], shift=SHIFTS[n]).blends[0, 1] for n in (1, 2)
    }
    return Cells(
        members=members, window=(0.1, 0.8), exist="these exist for", shifts=SHIFTS, blends=blends
    )


def rank(cell, u):
    return cell.density_of(cell.family.shape(u))


def at(weights):
    return np.concatenate([POINTS, np.outer(weights, np.ones(POINTS.shape[1]))])


def mean_of(cells, n, weight, u):
    """Mean of the first and another cell by their ranks; two sheets keep their sides."""
    second, moved = cells.members[n], u - np.array(SHIFTS[n])[:, None]
    ends = [rank(cells.members[0], u), rank(second, moved)]
    if n == 1:
        ends = [ends[0] * np.sign(waves(u)), ends[1] * np.sign(spirals(moved))]
    mean = (1 - weight) * ends[0] + weight * ends[1]
    return np.abs(mean) if n == 1 else mean


@pytest.mark.parametrize("n", [1, 2], ids=["two sheets", "sheet and struts"])
@pytest.mark.parametrize("weight", [0.125, 0.375])
def test_a_mix_is_the_share_of_the_cell_below_its_weighted_mean(three, n, weight):
    weights = np.zeros(3)
    weights[[0, n]] = 1 - weight, weight
    sampled = np.sort(mean_of(three, n, weight, spread_points(300_000)))
    below = np.searchsorted(sampled, mean_of(three, n, weight, POINTS)) / sampled.size
    # Two of the 17 tabulated weights. Three standard deviations of a share of 48^3 random samples
    # are 1.5 / sqrt(48^3) at most; those of the table are spread evenly.
    np.testing.assert_allclose(three.shape(at(weights)), below, rtol=0, atol=0.0045)


def test_alone_each_cell_stands_where_it_is_moved_to(three):
    for n, cell in enumerate(three.members):
        moved = POINTS - np.array(SHIFTS[n])[:, None]
        np.testing.assert_array_equal(three.shape(at(np.eye(3)[n])), rank(cell, moved))
    np.testing.assert_array_equal(three.shape(POINTS), rank(three.members[0], POINTS))


def test_without_a_blend_the_larger_weight_counts_and_of_three_the_two_largest(three):
    spirals_alone, bars_alone = (three.shape(at(np.eye(3)[n])) for n in (1, 2))
    np.testing.assert_array_equal(three.shape(at([0.0, 0.45, 0.55])), bars_alone)
    np.testing.assert_array_equal(three.shape(at([0.1, 0.5, 0.4])), spirals_alone)
    np.testing.assert_allclose(
        three.shape(at([0.6, 0.3, 0.1])), three.shape(at([2 / 3, 1 / 3, 0.0])), atol=1e-12
    )


def test_a_single_cell_keeps_its_own_function_and_levels(three):
    (cell,) = single(three.members[2]).members
    np.testing.assert_array_equal(single(cell).shape(POINTS), bars(POINTS))
    assert single(cell).level_of(0.3) == cell.level_of(0.3)
    assert single(cell).window == cell.window
    with pytest.raises(DensityError, match=r"these exist for relative densities 0\.1000 to 0\.8"):
        three.level_of([0.3, 0.9])


def test_weights_by_place_are_those_given_or_the_usual(three):
    np.testing.assert_array_equal(three.weights_at(POINTS), at([1, 0, 0])[3:])
    pair = cell_pair(*three.members[:2])
    np.testing.assert_array_equal(pair.weights_at(POINTS), np.full((2, 4000), 0.5))


def test_weights_of_a_row_rise_from_one_cell_to_the_next():
    share = np.array([-0.2, 0.0, 0.1, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(
        row_weights(share, 3), [[1, 1, 0.8, 0, 0, 0], [0, 0, 0.2, 1, 0.5, 0], [0, 0, 0, 0, 0.5, 1]]
    )
    first, second, part = largest_two(row_weights(np.array([0.75]), 3))
    assert (first[0], second[0], part[0]) == (1, 2, 0.5)
