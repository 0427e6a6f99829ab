"""Transitions between families: ends untouched, density exact between, one piece, necks measured.

The families here are closed forms of few lines; installed ones are paired in tests/verification.
"""

from functools import cache

import numpy as np
import pytest
from oracles.transition_density import density_error

from gradedesign.errors import DensityError, LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.cells import cell_pair
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.neck import joining_shift, measure_neck
from gradedesign.geometry.cell.shape import spread_points


def square_distance(u, *axes):
    """Distance in the plane of two axes from the lines through whole numbers."""
    away = np.abs(u - np.round(u))
    return np.hypot(away[axes[0]], away[axes[1]])


def cubic_struts(u):
    return np.minimum.reduce([square_distance(u, *a) for a in ((0, 1), (1, 2), (0, 2))])


def middle_struts(u):
    return cubic_struts(u - 0.5)


def sheet(u):
    return np.abs(10 * np.cos(2 * np.pi * u).sum(axis=0))


@cache
def struts():
    """Struts along the edges, calibrated by the first test that needs them."""
    return calibrate(CellFamily(name="struts", shape=cubic_struts, distance=True))


@cache
def middle():
    return calibrate(CellFamily(name="middle", shape=middle_struts, distance=True))


@cache
def sheets():
    return calibrate(CellFamily(name="sheet", shape=sheet, sides=2))


POINTS = spread_points(60_000)


def at(weight):
    return np.concatenate([POINTS, [np.full(POINTS.shape[1], w) for w in (1 - weight, weight)]])


@pytest.mark.parametrize("scale", ["rank", "distance"])
def test_the_ends_are_the_families_themselves(scale):
    mixed = cell_pair(struts(), sheets(), scale=scale, shift=(0.5, 0.0, 0.0))
    moved = POINTS - np.array([[0.5], [0], [0]])
    for weight, family, u in ((0.0, struts(), POINTS), (1.0, sheets(), moved)):
        g = family.family.shape(u)
        for rho in (0.2, 0.3, 0.4):
            exact = g <= family.level_of(rho)
            np.testing.assert_array_equal(mixed.shape(at(weight)) <= rho, exact)


@pytest.mark.parametrize("scale", ["rank", "distance"])
def test_the_density_of_every_mix_is_the_one_asked_for(scale):
    mixed = cell_pair(struts(), sheets(), scale=scale)
    for weight in (0.03, 0.21, 0.5, 0.77):
        values = mixed.shape(at(weight))
        assert values.min() >= 0
        assert values.max() <= 1
        for rho in (0.15, 0.3, 0.45):
            assert np.mean(values <= rho) == pytest.approx(rho, abs=0.003)


def test_half_way_it_is_neither_family():
    # The sheet's values are 30 times those of the struts: the plain mean of both functions is
    # nearly the sheet already at a weight of one half.
    g = struts().family.shape(POINTS) + sheets().family.shape(POINTS)
    sheet_alone = sheets().family.shape(POINTS) <= sheets().level_of(0.3)
    assert np.mean((g <= np.quantile(g, 0.3)) != sheet_alone) < 0.02
    mixed = cell_pair(struts(), sheets())
    half = mixed.shape(at(0.5)) <= 0.3
    for weight in (0.0, 1.0):
        assert np.mean(half != (mixed.shape(at(weight)) <= 0.3)) > 0.1


def test_without_a_weight_it_is_one_half():
    mixed = cell_pair(struts(), sheets())
    np.testing.assert_array_equal(mixed.shape(POINTS), mixed.shape(at(0.5)))
    grid = at(0.25).reshape(5, 100, 600)
    np.testing.assert_array_equal(mixed.shape(grid).ravel(), mixed.shape(at(0.25)))


def test_families_without_a_common_density_are_refused():
    mixed = cell_pair(struts(), sheets())
    assert mixed.window == (
        max(struts().window[0], sheets().window[0]), min(struts().window[1], sheets().window[1]),
    )  # fmt: skip
    with pytest.raises(DensityError, match="both exist"):
        mixed.level_of(0.995)


def test_the_neck_of_struts_is_their_diameter():
    mixed = cell_pair(struts(), struts())
    neck = measure_neck(mixed, 0.2, resolution=40)
    diameter = 2 * float(struts().level_of(0.2))
    assert neck.components == 1
    assert neck.width == pytest.approx(diameter, abs=1 / 40)
    assert neck.first_width == neck.width
    assert density_error(mixed, 0.2) < 0.002
    # The planes with least solid cut four quarters of one strut: its section over the density.
    assert neck.area == pytest.approx(np.pi / 4 * diameter**2 / 0.2, rel=0.05)


def test_struts_that_pass_each_other_are_moved_to_join():
    plain = measure_neck(cell_pair(struts(), middle()), 0.12, length=1.0, resolution=16)
    assert plain.components > 1
    assert plain.width == 0
    shift = joining_shift(struts(), middle(), 0.12, length=1.0, resolution=16)
    assert any(shift)
    joined = cell_pair(struts(), middle(), shift=shift)
    neck = measure_neck(joined, 0.12, length=1.0, resolution=16)
    assert neck.components == 1
    assert neck.width > 0
    assert joining_shift(struts(), struts(), 0.12, resolution=16) == (0.0, 0.0, 0.0)


def test_a_bar_without_length_is_refused():
    with pytest.raises(LatticeError, match="cannot be measured"):
        measure_neck(cell_pair(struts(), struts()), 0.2, length=0.0)
