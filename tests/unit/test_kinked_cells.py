"""Cells with flat faces and kinks; expected numbers are volumes of boxes."""

import numpy as np
import pytest

from gradedesign import CaseError, CellFamily
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.shape import evaluate_shape, spread_points
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.testing import check_cell_family


def square_bars(u, ratio=1.0):
    """Bars of square section along the axes; those along z thicker by a ratio."""
    x, y, z = np.abs(u - np.round(u))
    return np.minimum.reduce([np.maximum(y, z), np.maximum(x, z), np.maximum(x, y) / ratio])


BARS = CellFamily(name="square-bars", shape=square_bars, parameters={"ratio": 1.0})


@pytest.mark.parametrize("t", [0.05, 0.1234, 0.25, 0.4])
def test_flat_faces_are_calibrated_exactly(t):
    # Three square bars of width w = 2 t: volume 3 w^2 - 2 w^3.
    rho = 3 * (2 * t) ** 2 - 2 * (2 * t) ** 3
    assert calibrate(BARS).level_of(rho) == pytest.approx(t, rel=1e-3)
    assert calibrate(BARS).density_of(t) == pytest.approx(rho, abs=2e-4)


def test_bars_conform():
    check_cell_family(BARS)


@pytest.mark.parametrize("ratio", [1.0, 1.6])
def test_walls_of_bars_are_measured_from_their_axes(ratio):
    # The thinner bars are 2 t wide; their shape is no distance, so the width is measured.
    parameters = {"ratio": ratio}
    calibration = calibrate(BARS, parameters)
    for rho in (0.05, 0.2, 0.5):
        wall = wall_mm(calibrate(BARS, parameters), rho, 10.0)
        assert wall == pytest.approx(20.0 * calibration.level_of(rho), rel=0.01)


def test_spread_points_share_no_coordinate_and_fill_evenly():
    points = spread_points(4096)
    for row in points:
        assert np.diff(np.sort(row)).min() > 1e-6
    # A box counts its volume within the discrepancy of the sequence, below 1/sqrt(n) = 0.016.
    rng = np.random.default_rng(77)
    for corner in rng.uniform(0.2, 1.0, (20, 3)):
        inside = (points < corner[:, None]).all(axis=0)
        assert np.mean(inside) == pytest.approx(corner.prod(), abs=0.008)


def test_errors_raised_on_purpose_keep_their_kind():
    def choosy(u, ratio):
        raise CaseError(f"a ratio of {ratio:g} is impossible; use 1 to 2")

    family = CellFamily(name="choosy", shape=choosy, parameters={"ratio": 3.0})
    with pytest.raises(CaseError, match=r"cell 'choosy' with .*ratio of 3 is impossible"):
        evaluate_shape(family, family.parameters, np.zeros((3, 4)))
