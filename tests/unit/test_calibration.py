"""Level and density; expected numbers from reference properties.md 4.3 and voxel counts."""

import logging

import numpy as np
import pytest

from gradedesign import CaseError, CellFamily, DensityError, PluginError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.shape import complete_parameters, evaluate_shape, grid_nodes
from gradedesign.geometry.cell.wall_size import density_for_wall, wall_mm
from gradedesign.geometry.maps.cell_map import uniform_map


def waves(u, amplitude=1.0):
    """Sum of three cosines; the third scaled."""
    x, y, z = np.cos(2 * np.pi * u)
    return x + y + amplitude * z


def sheet(u):
    return np.abs(waves(u))


def not_finite(u, a):
    return u[0] * np.nan


def wrong_shape(u, a):
    return u


def raising(u, a):
    return 1 / 0


NETWORK = CellFamily(name="waves-network", shape=waves, parameters={"amplitude": 1.0})
SHEET = CellFamily(name="waves-sheet", shape=sheet, sides=2)


@pytest.mark.parametrize(
    ("family", "rho", "level"),
    [
        (NETWORK, 0.3, -0.6990),
        (NETWORK, 0.5, 0.0),
        (SHEET, 0.1, 0.1756),
        (SHEET, 0.2, 0.3506),
        (SHEET, 0.3, 0.5252),
        (SHEET, 0.4, 0.6990),
        (SHEET, 0.5, 0.8735),
    ],
)
def test_level_matches_the_reference_table(family, rho, level):
    # properties.md 4.3, "Level to density", primitive.
    assert calibrate(family).level_of(rho) == pytest.approx(level, abs=0.002)


@pytest.mark.parametrize("family", [NETWORK, SHEET], ids=lambda f: f.name)
def test_density_matches_a_voxel_count(family):
    calibration = calibrate(family)
    grid = family.shape(grid_nodes(160, (0.5, 0.5, 0.5)))
    for rho in np.linspace(*calibration.window, 7):
        assert np.mean(grid <= calibration.level_of(rho)) == pytest.approx(rho, abs=0.003)


def test_windows_are_those_of_the_saddles():
    # Volume below the saddle -1 of cos X + cos Y + cos Z: 0.2133 by a count at 240^3; properties.md
    # 4.3 gives 0.214. A sheet's labyrinths close at |f| = 1.
    count = waves(grid_nodes(120, (0.21, 0.43, 0.77)))
    below = float(np.mean(count <= -1))
    assert calibrate(NETWORK).window == pytest.approx((below, 1 - below), abs=1e-3)
    assert calibrate(SHEET).window == pytest.approx((0.01, 1 - 2 * below), abs=2e-3)


def test_round_trip_and_monotone():
    calibration = calibrate(NETWORK)
    rho = np.linspace(*calibration.window, 200)
    level = calibration.level_of(rho)
    assert (np.diff(level) > 0).all()
    np.testing.assert_allclose(calibration.density_of(level), rho, atol=1e-12)


def test_outside_the_window_is_an_error_that_states_it():
    with pytest.raises(DensityError, match=r"densities 0\.213\d to 0\.786\d.*0\.1000"):
        calibrate(NETWORK).level_of(np.array([0.1, 0.3]))
    with pytest.raises(DensityError):
        calibrate(NETWORK).level_of(np.nan)


def test_kept_and_overridden_parameters():
    assert calibrate(NETWORK) is calibrate(NETWORK, {"amplitude": 1})
    other = calibrate(NETWORK, {"amplitude": 0.9})
    assert other.parameters["amplitude"] == 0.9
    assert other.window != calibrate(NETWORK).window
    with pytest.raises(CaseError, match="amplitude"):
        calibrate(NETWORK, {"amplitud": 1.0})
    assert complete_parameters(SHEET, None) == {}


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (not_finite, "not finite"),
        (wrong_shape, "shape"),
        (raising, "ZeroDivisionError"),
    ],
)
def test_broken_shapes_name_cell_and_parameters(shape, message):
    family = CellFamily(name="broken", shape=shape, parameters={"a": 2.5})
    with pytest.raises(PluginError, match=message) as error:
        evaluate_shape(family, family.parameters, np.zeros((3, 4)))
    assert "'broken'" in str(error.value)
    assert "2.5" in str(error.value)


def test_a_plateau_is_refused():
    family = CellFamily(name="steps", shape=lambda u: np.maximum(waves(u), -0.2))
    with pytest.raises(PluginError, match="constant"):
        calibrate(family)


def test_a_cell_that_never_connects_is_refused():
    plates = CellFamily(name="plates", shape=lambda u: np.abs(np.sin(2 * np.pi * u[0])), sides=2)
    with pytest.raises(DensityError, match="three directions"):
        calibrate(plates)


def test_sheet_wall_is_the_thinnest_of_the_reference():
    # ramirez.md R2: primitive sheet, C = 0.5, L = 50 mm: 4.64 to 8.26 mm thick.
    rho = calibrate(SHEET).density_of(0.5)
    assert wall_mm(calibrate(SHEET), rho, 50.0) == pytest.approx(4.64, rel=0.01)


def test_network_neck_is_the_hole_of_the_dual_surface():
    # At rho 0.5 the neck about (0.5, 0.5, 0) is bounded by cos X + cos Y + 1 = 0; nearest points
    # on the diagonals X = Y = 2 pi / 3, so the diameter is 2 sqrt(2) (1/2 - 1/3) cells.
    expected = 2 * np.sqrt(2) / 6 * 10.0
    assert wall_mm(calibrate(NETWORK), 0.5, 10.0) == pytest.approx(expected, rel=0.005)


def test_distance_families_have_exact_walls():
    def bars(u):
        away = np.abs(u - np.round(u))
        squares = away**2
        return np.sqrt(
            np.minimum.reduce(
                [squares[[1, 2]].sum(0), squares[[0, 2]].sum(0), squares[[0, 1]].sum(0)]
            )
        )

    family = CellFamily(name="bars", shape=bars, distance=True)
    # Three crossing cylinders of radius r: volume 3 pi r^2 - 8 sqrt(2) r^3 (Steinmetz).
    r = 0.1
    rho = 3 * np.pi * r**2 - 8 * np.sqrt(2) * r**3
    assert wall_mm(calibrate(family), rho, 20.0) == pytest.approx(2 * r * 20.0, rel=0.003)


def test_walls_grow_and_invert(caplog):
    caplog.set_level(logging.INFO)
    a, b = calibrate(SHEET).window
    wall = wall_mm(calibrate(SHEET), np.linspace(a, b, 100), 8.0)
    assert (np.diff(wall) >= 0).all()
    rho = density_for_wall(calibrate(SHEET), 0.5, 8.0)
    assert wall_mm(calibrate(SHEET), rho, 8.0) >= 0.5
    assert wall_mm(calibrate(SHEET), rho - 0.001, 8.0) < 0.5
    with pytest.raises(DensityError, match="larger cells"):
        density_for_wall(calibrate(SHEET), 5.0, 8.0)


def test_uniform_map_turns_scales_and_shifts():
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    to_cell = uniform_map((10.0, 20.0, 5.0), origin=(1.0, 2.0, 3.0), rotation=turn)
    # Columns are the axes: cell x is global y, cell y is global -x.
    np.testing.assert_allclose(to_cell(np.array([1.0, 12.0, 3.0])), [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(to_cell(np.array([-19.0, 2.0, 8.0])), [0, 1, 1], atol=1e-15)
    assert to_cell(np.zeros((3, 4, 5))).shape == (3, 4, 5)
    np.testing.assert_allclose(uniform_map(50.0)(np.full((3, 2), 25.0)), 0.5)


@pytest.mark.parametrize(
    ("size", "rotation"),
    [(0.0, None), (np.nan, None), (1.0, np.diag([1, 1, -1])), (1.0, 2 * np.eye(3))],
)
def test_impossible_maps_are_refused(size, rotation):
    with pytest.raises(CaseError):
        uniform_map(size, rotation=rotation)
