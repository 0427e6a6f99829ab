"""Shapes that repeat after several cells; expected numbers are those of the shape of period 1."""

import numpy as np
import pytest

from gradedesign import CellFamily, DensityError, PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.percolation import percolation
from gradedesign.geometry.cell.shape import grid_nodes
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.testing import check_cell_family


def waves(u):
    return np.cos(2 * np.pi * u).sum(axis=0)


def long_waves(u):
    return waves(u / 3)


def pore(u):
    """Solid outside a ball about the middle of each cell; the pores are closed at first."""
    return -np.linalg.norm(np.mod(u, 1.0) - 0.5, axis=0)


ONE = CellFamily(name="waves", shape=waves)
LONG = CellFamily(name="long-waves", shape=long_waves, period=3)
LONG_SHEET = CellFamily(name="long-sheet", shape=lambda u: np.abs(long_waves(u)), period=3, sides=2)


def test_a_network_of_long_period_conforms():
    check_cell_family(LONG)


@pytest.mark.slow
def test_a_sheet_of_long_period_conforms():
    check_cell_family(LONG_SHEET)


def test_a_stretched_cell_has_the_levels_of_the_cell():
    # Stretching by 3 changes no volume fraction and no connection, and makes walls 3 times thicker.
    one, long = calibrate(ONE), calibrate(LONG)
    np.testing.assert_allclose(long.window, one.window, atol=1e-3)
    rho = np.linspace(0.25, 0.75, 11)
    np.testing.assert_allclose(long.level_of(rho), one.level_of(rho), atol=1e-12)
    assert sorted(long.neck) == pytest.approx([3 * x for x in sorted(one.neck)])
    wall = wall_mm(calibrate(ONE), rho, 1.0)
    np.testing.assert_allclose(wall_mm(calibrate(LONG), rho, 1.0), 3 * wall, rtol=0.01)


@pytest.mark.slow
def test_a_sheet_of_long_period_has_three_times_the_wall():
    sheet = CellFamily(name="sheet", shape=lambda u: np.abs(waves(u)), sides=2)
    wall = wall_mm(calibrate(sheet), np.array([0.2, 0.5]), 1.0)
    np.testing.assert_allclose(
        wall_mm(calibrate(LONG_SHEET), np.array([0.2, 0.5]), 1.0), 3 * wall, rtol=0.01
    )


def test_a_longer_period_than_needed_is_no_error():
    # The same cell, eight to the window: the same levels within the sampling.
    again = calibrate(CellFamily(name="waves", shape=waves, period=2))
    rho = np.linspace(0.25, 0.75, 11)
    np.testing.assert_allclose(again.level_of(rho), calibrate(ONE).level_of(rho), atol=2e-3)


@pytest.mark.parametrize("period", [1, 2, 4])
def test_a_wrong_period_is_refused(period):
    family = CellFamily(name="wrong", shape=long_waves, period=period)
    message = rf"cell 'wrong'.*change by [\d.]+ over {period} cell.*the period must be {period}"
    with pytest.raises(PluginError, match=message):
        calibrate(family)


def test_a_wrong_period_along_one_axis_is_named():
    family = CellFamily(name="z", shape=lambda u: waves(u * np.array([1, 1, 0.5])[:, None]))
    with pytest.raises(PluginError, match="along z"):
        calibrate(family)


@pytest.mark.parametrize("period", [0, -2, 1.5, "2"])
def test_impossible_periods_are_refused(period):
    with pytest.raises(PluginError, match="expected a whole number"):
        CellFamily(name="none", shape=waves, period=period)


def test_closed_pores_are_usable_only_when_declared():
    # Balls of radius r leave 1 - 4/3 pi r^3; they touch at r = 1/2, and at r = sqrt(1/2) they cut
    # the solid at the middle of the cell's edges.
    grid = pore(grid_nodes(24))
    assert percolation(grid).ceiling == pytest.approx(-0.5, abs=0.03)
    assert percolation(grid, open_void=False).ceiling == pytest.approx(0.0, abs=0.05)
    closed = calibrate(CellFamily(name="pore", shape=pore, open_void=False))
    opened = calibrate(CellFamily(name="pore", shape=pore))
    assert opened.window[1] == pytest.approx(1 - np.pi / 6, abs=0.02)
    assert closed.window == pytest.approx((opened.window[0], 0.99), abs=1e-9)
    assert closed.level_of(1 - np.pi / 6 * 0.8**3) == pytest.approx(-0.4, abs=1e-3)


def test_a_solid_in_pieces_is_refused_with_closed_pores_too():
    plates = CellFamily(
        name="plates", shape=lambda u: np.abs(np.sin(2 * np.pi * u[0])), open_void=False
    )
    with pytest.raises(DensityError, match=r"three directions; it cannot"):
        calibrate(plates)
