"""What a map makes, measured on maps whose cells are known."""

import numpy as np
import pytest
from oracles.density_achieved import density_achieved
from oracles.naive_size_map import naive_size_map

from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.calibration import calibrate
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.maps.cell_map import CellMap, constant_jacobian, uniform_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.map_report import map_report, require_unfolded, spread, volume_points

LOWER, UPPER = np.zeros(3), np.array([40.0, 30.0, 20.0])
POINTS = volume_points(None, LOWER, UPPER, 4000)


def linear(matrix):
    m = np.array(matrix, dtype=float)
    return CellMap(
        name="linear",
        coordinates=lambda p: np.tensordot(m, p, axes=1),
        jacobian=lambda p: constant_jacobian(m, p),
        size=1.0,
    )


FAMILY = CellFamily(
    name="test-cross",
    shape=lambda u: np.sort(np.abs(np.mod(u, 1.0) - 0.5), axis=0)[1],
    source="square struts along the axes, half width t: 12 t^2 - 16 t^3",
)


def test_equal_cells_have_their_size_no_shear_and_no_folds():
    found = map_report(uniform_map((4.0, 5.0, 8.0)), POINTS, wanted=5.0)
    assert [s.p50 for s in found.size_by_axis] == pytest.approx([4.0, 5.0, 8.0])
    assert (found.size.least, found.size.p50, found.size.most) == pytest.approx((4.0, 5.0, 8.0))
    assert (found.shear.most, found.turn.most) == pytest.approx((0.0, 0.0), abs=1e-5)
    assert (found.folds, found.fold_at) == (0.0, None)
    # |4/5 - 1| = 0.2, |5/5 - 1| = 0, |8/5 - 1| = 0.6: one axis of three is right.
    assert found.size_error.error.most == pytest.approx(0.6)
    assert found.size_error.within_5 == pytest.approx(1 / 3)
    assert found.size_error.worst_within_5 == 0.0
    require_unfolded(found)


def test_shear_is_the_departure_from_a_right_angle():
    tangent = np.tan(np.radians(12.0))
    found = map_report(linear([[0.2, 0.2 * tangent, 0.0], [0.0, 0.2, 0.0], [0, 0, 0.2]]), POINTS)
    assert found.shear.p50 == pytest.approx(12.0)
    assert found.turn.p50 == pytest.approx(12.0)


def test_turn_is_against_the_axes_of_the_coordinates():
    c, s = np.cos(0.3), np.sin(0.3)
    axes = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turned = uniform_map(5.0, rotation=axes)
    assert map_report(turned, POINTS).turn.p50 == pytest.approx(np.degrees(0.3))
    assert map_report(turned, POINTS).shear.most == pytest.approx(0.0, abs=1e-5)


def test_folds_are_counted_by_volume_and_named():
    # x / L folds where x dL/dx > L; here that is x^2 > 300.
    folding = naive_size_map(lambda p: 10 + (p[0] - 10) ** 2 / 20, step=1e-3, typical=10.0)
    found = map_report(folding, POINTS)
    assert found.folds == pytest.approx((40 - np.sqrt(300)) / 40, abs=2e-3)
    with pytest.raises(LatticeError, match=r"naive cell map folds in 56\.\d %"):
        require_unfolded(found)


def test_percentiles_by_weight():
    values = np.array([3.0, 1.0, 2.0, 4.0])
    found = spread(values, np.array([1.0, 94.5, 1.0, 3.5]))
    assert (found.least, found.p5, found.p50, found.p95, found.p99, found.most) == (
        1,
        1,
        1,
        2,
        4,
        4,
    )


def test_a_part_that_reaches_the_axis_of_its_map_is_refused():
    around = cylindrical_map(around=8, radial_size=5.0, axial_size=5.0, inner_radius=3.0)
    with pytest.raises(LatticeError, match="cells shrink to nothing"):
        map_report(around, POINTS)


def test_no_points_are_refused():
    with pytest.raises(LatticeError, match="no place of the part is left"):
        map_report(uniform_map(4.0), np.zeros((3, 0)))
    with pytest.raises(LatticeError, match="0 points"):
        density_achieved(uniform_map(4.0), calibrate(FAMILY), 0.2, np.zeros((3, 0)))


def test_volume_points_fill_a_ball_evenly():
    points = volume_points(
        lambda p: np.sqrt((p**2).sum(axis=0)) - 3.0, -4 * np.ones(3), 4 * np.ones(3), 20_000
    )
    radius = np.sqrt((points**2).sum(axis=0))
    assert points.shape[1] == pytest.approx(20_000 * 36 * np.pi / 512, rel=0.01)
    assert (radius <= 3.0).all()
    assert (radius**3).mean() == pytest.approx(13.5, rel=0.01)


@pytest.mark.parametrize("matrix", [np.eye(3) / 5.0, [[0.2, 0.05, 0], [0, 0.3, 0.1], [0, 0, 0.1]]])
def test_density_is_kept_by_stretched_and_sheared_cells(matrix):
    points = volume_points(None, LOWER, UPPER, 200_000)
    found = density_achieved(linear(matrix), calibrate(FAMILY), 0.2, points, slabs=4, axis=1)
    assert found.nominal == pytest.approx(0.2)
    assert found.effective == pytest.approx(0.2, abs=0.003)
    assert len(found.slabs) == 4
    assert found.slabs[1].low == pytest.approx(7.5, abs=0.01)
    assert np.mean([s.effective for s in found.slabs]) == pytest.approx(found.effective, abs=1e-4)


def test_density_follows_a_field_slab_by_slab():
    points = volume_points(None, LOWER, UPPER, 200_000)
    found = density_achieved(
        uniform_map(4.0), calibrate(FAMILY), lambda p: 0.1 + 0.01 * p[0], points, slabs=10
    )
    for number, one in enumerate(found.slabs):
        assert one.nominal == pytest.approx(0.12 + 0.04 * number, abs=1e-3)
        assert one.effective == pytest.approx(one.nominal, abs=0.01)
