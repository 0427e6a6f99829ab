"""Cells that a map makes at points: axes, extents, stretch."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.cell_layout import cell_layout, layout_warnings
from gradedesign.geometry.maps.cell_map import CellMap, constant_jacobian, uniform_map
from gradedesign.geometry.maps.cylindrical_map import cylindrical_map
from gradedesign.geometry.maps.local_cells import local_cells

POINTS = np.array([[30.0, 0.0, -35.0, 20.0], [0.0, 45.0, 0.0, 25.0], [1.0, 2.0, 3.0, -4.0]])
TURNED = Rotation.from_euler("XYZ", (20, -35, 50), degrees=True).as_matrix()


def test_axes_and_edges_of_a_turned_grid():
    edges = (4.0, 6.0, 9.0)
    cells = local_cells(uniform_map(edges, rotation=TURNED), POINTS, edges)
    for k in range(4):
        np.testing.assert_allclose(cells.axes[:, :, k], TURNED, atol=1e-12)
    np.testing.assert_allclose(cells.least, 4.0)
    np.testing.assert_allclose(cells.most, 9.0)
    np.testing.assert_allclose(cells.size, 6.0)  # (4 * 6 * 9)^(1/3) = 6
    np.testing.assert_allclose(cells.stretch, 1.0)
    # of a cube, the same cells are stretched by 9 / 4
    cubes = local_cells(uniform_map(edges, rotation=TURNED), POINTS)
    np.testing.assert_allclose(cubes.stretch, 2.25)


def test_cells_about_an_axis_point_along_radius_and_turn():
    cell_map = cylindrical_map(around=40, radial_size=5, axial_size=5, inner_radius=10)
    cells = local_cells(cell_map, POINTS)
    radius = np.hypot(*POINTS[:2])
    zero = np.zeros(4)
    np.testing.assert_allclose(cells.axes[:, 0], [*(POINTS[:2] / radius), zero], atol=1e-12)
    turn = np.array([-POINTS[1], POINTS[0]]) / radius
    np.testing.assert_allclose(cells.axes[:, 1], [*turn, zero], atol=1e-12)
    np.testing.assert_allclose(cells.axes[2, 2], 1.0, atol=1e-12)
    # By hand: a cell is 2 pi r / 40 wide and 5 mm high and deep.
    width = 2 * np.pi * radius / 40
    np.testing.assert_allclose(cells.least, np.minimum(width, 5))
    np.testing.assert_allclose(cells.most, np.maximum(width, 5))
    np.testing.assert_allclose(cells.stretch, np.maximum(width / 5, 5 / width))


def test_a_singular_place_has_global_axes_of_typical_size():
    cell_map = cylindrical_map(around=40, radial_size=5, axial_size=5, inner_radius=10)
    cells = local_cells(cell_map, np.zeros((3, 1)))
    np.testing.assert_array_equal(cells.axes[:, :, 0], np.eye(3))
    assert cells.size[0] == pytest.approx(cell_map.size)


def test_a_shear_is_split_evenly_between_the_axes():
    # u = (x + s y, y): the nearest rotation turns by half of the shear angle atan(s) in the limit
    # of small s; extents are 1 / singular values of [[1, s], [0, 1]], 1 -+ s / 2.
    s = 1e-3
    slope = np.array([[1, s, 0], [0, 1, 0], [0, 0, 1.0]])
    cell_map = CellMap(
        name="sheared", size=1.0,
        coordinates=lambda x: np.tensordot(slope, x, axes=1),
        jacobian=lambda x: constant_jacobian(slope, x),
    )  # fmt: skip
    cells = local_cells(cell_map, np.zeros((3, 1)))
    assert np.arcsin(cells.axes[1, 0, 0]) == pytest.approx(s / 2, rel=1e-3)
    assert cells.least[0] == pytest.approx(1 - s / 2, rel=1e-6)
    assert cells.most[0] == pytest.approx(1 + s / 2, rel=1e-6)


def test_a_layout_tells_stretch_and_refuses_folds():
    cell_map = cylindrical_map(around=40, radial_size=5, axial_size=5, inner_radius=10)
    ring = POINTS[:, :2]
    layout = cell_layout(cell_map, ring, (5.0, 5.0, 5.0))
    assert layout.least == pytest.approx(2 * np.pi * 30 / 40)
    assert layout.report["stretch"]["most"] == pytest.approx(2 * np.pi * 45 / 40 / 5, rel=1e-6)
    (told,) = layout_warnings(layout, "some-law")
    assert "stretches cells" in told
    assert layout_warnings(cell_layout(uniform_map(5.0), ring, (5.0,) * 3), "law") == ()
    inside_out = CellMap(
        name="mirrored", size=1.0,
        coordinates=lambda x: -x, jacobian=lambda x: constant_jacobian(-np.eye(3), x),
    )  # fmt: skip
    with pytest.raises(LatticeError, match="mirrored cell map folds in 100 %"):
        cell_layout(inside_out, ring, (1.0, 1.0, 1.0))
