"""The grid of finite cells, its elements and weak supports."""

import numpy as np
import pytest

from gradedesign.errors import CaseError, LatticeError
from gradedesign.mechanics.finite_cell.basis import gauss_places, gauss_weights
from gradedesign.mechanics.finite_cell.elements import cut_elements, solid_volume
from gradedesign.mechanics.finite_cell.grid import Plane, fit_grid
from gradedesign.mechanics.finite_cell.space import brick_space
from gradedesign.mechanics.finite_cell.surface import element_table, locate


def ball(points):
    shape = (3, *[1] * (points.ndim - 1))
    centre = np.array([0.03, 0.01, 0.02]).reshape(shape)
    return np.sqrt(((points - centre) ** 2).sum(axis=0)) - 0.77


def test_the_grid_meets_the_faces_of_the_box_and_most_planes():
    planes = (
        Plane(axis=0, place=2.5, area=9.0),
        Plane(axis=0, place=1.0),
        Plane(axis=1, place=0.7),
    )
    grid = fit_grid((0, 0, 0), (10, 4, 3), 1.1, planes)
    # 10 / 12 is the widest brick of 1.1 mm or less that has a plane at 2.5 mm.
    assert grid.shape == (12, 4, 3)
    assert [p.place for p in grid.missed] == [1.0, 0.7]
    with pytest.raises(CaseError, match="box of the finite cells is empty"):
        fit_grid((0, 0, 0), (1, 0, 1), 0.5)
    with pytest.raises(CaseError, match="expected more than 0"):
        fit_grid((0, 0, 0), (1, 1, 1), 0.0)


def test_volume_converges_with_third_order():
    exact = 4.0 / 3.0 * np.pi * 0.77**3
    errors = []
    for count in (4, 8, 16):
        elements = cut_elements(ball, fit_grid([-1] * 3, [1] * 3, 2 / count))
        errors.append(abs(solid_volume(elements) / exact - 1.0))
        points = elements.share.sum(axis=1)
        np.testing.assert_allclose(points, elements.weights.sum(axis=1), atol=1e-6)
    # Interpolated samples themselves lose 1.3, 0.33 and 0.08 %.
    assert errors[0] < 2e-4
    assert np.log2(errors[0] / errors[2]) / 2 > 2.9


def test_thin_struts_and_sharp_edges_keep_their_volume():
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)

    def rod(points):
        along = np.einsum("d,d...->...", axis, points)
        across = np.sqrt(np.maximum((points**2).sum(axis=0) - along**2, 0.0))
        return np.maximum(across - 0.11, np.abs(along) - 0.6)

    def block(points):
        half = np.array([0.613, 0.527, 0.731]).reshape(3, *[1] * (points.ndim - 1))
        return (np.abs(points) - half).max(axis=0)

    # 0.9 bricks across; interpolated samples lose 5.2 and 0.57 %.
    grid = fit_grid([-1] * 3, [1] * 3, 0.25)
    assert solid_volume(cut_elements(rod, grid)) == pytest.approx(np.pi * 0.11**2 * 1.2, rel=5e-3)
    exact = 8 * 0.613 * 0.527 * 0.731
    assert solid_volume(cut_elements(block, grid)) == pytest.approx(exact, rel=2e-3)


def test_cut_elements_integrate_polynomials_over_a_half_space():
    normal = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)

    def half(points):
        return np.einsum("d,d...->...", normal, points) - 0.1

    moments = []
    for spacing in (0.5, 0.2):
        grid = fit_grid([-1] * 3, [1] * 3, spacing)
        elements = cut_elements(half, grid)
        weights = np.concatenate(
            [np.tile(gauss_weights(5), (elements.whole, 1)), elements.weights]
        ) * np.prod(grid.edges)
        places = gauss_places(5)[:, None] + elements.position.T[:, :, None]
        x, y, z = grid.lower[:, None, None] + grid.edges[:, None, None] * places
        moments.append([(weights * f).sum() for f in (x**0, x * y**2 * z**2, x**2 * y)])
    # Degree 6 on the cut triangles is exact; finer elements must not change it.
    np.testing.assert_allclose(moments[0], moments[1], rtol=1e-12)


def test_crumbs_are_left_out_and_halves_refused():
    def field(points):
        shape = (3, *[1] * (points.ndim - 1))
        crumb = np.sqrt(((points - np.full(shape, 0.9)) ** 2).sum(axis=0)) - 0.09
        return np.minimum(ball(points), crumb)

    elements = cut_elements(field, fit_grid([-1] * 3, [1] * 3, 0.125))
    assert elements.dropped == 1
    assert 0.0 < elements.dropped_share < 0.01
    alone = cut_elements(ball, fit_grid([-1] * 3, [1] * 3, 0.125))
    assert solid_volume(elements) == pytest.approx(solid_volume(alone), rel=1e-12)
    with pytest.raises(LatticeError, match="falls apart: 1 disconnected components hold 5"):
        cut_elements(lambda p: 0.2 - np.abs(p[0]), fit_grid([-1] * 3, [1] * 3, 0.25))
    both = cut_elements(lambda p: 0.2 - np.abs(p[0]), fit_grid([-1] * 3, [1] * 3, 0.25), bodies=2)
    assert both.dropped == 0


def test_a_field_that_is_not_finite_is_refused():
    def field(points):
        return np.where(points[0] > 0.5, np.nan, -1.0)

    with pytest.raises(LatticeError, match="not finite at"):
        cut_elements(field, fit_grid([-1] * 3, [1] * 3, 0.5))


def test_parts_on_either_side_of_a_gap_become_elements_of_their_own():
    # Two bars in one row of bricks, joined at the end x > 0.6 only.
    def fork(points):
        x, y, _ = points
        slit = np.maximum(np.abs(y - 0.5) - 0.15, x - 0.6)
        return np.maximum(np.abs(y - 0.5) - 0.45, -slit)

    elements = cut_elements(fork, fit_grid([0, 0, 0], [1, 1, 0.25], 0.25 + 1e-9))
    one = cut_elements(fork, fit_grid([0, 0, 0], [1, 1, 1], 1.0))
    assert len(one.position) == 1  # joined within the brick
    left = elements.position[:, 0] < 2
    space = brick_space(elements)
    low, high = (np.unique(space.nodes[left & (elements.position[:, 1] // 2 == k)]) for k in (0, 1))
    # Bricks of either bar meet in the plane y = 0.5, where none of them has solid.
    shared = np.intersect1d(low, high)
    assert (space.place[shared, 0] == 4).all()
    two = cut_elements(
        lambda p: 0.3 - np.abs(p[1] - 0.5), fit_grid([0, 0, 0], [3, 1, 1], 1.0), bodies=2
    )
    assert sorted(two.copy.tolist()) == [0, 0, 0, 1, 1, 1]
    assert two.colours.shape == (2, 17)
    nodes = brick_space(two)
    assert len(nodes.place) == 2 * 7 * 3 * 3
    assert not np.intersect1d(nodes.nodes[two.copy == 0], nodes.nodes[two.copy == 1]).size
    # Points belong to the part whose solid is nearest.
    table = element_table(two)
    at = np.array([[0.5, 0.5, 2.5], [0.05, 0.95, 0.1], [0.5, 0.5, 0.5]])
    below, above, far = locate(two, table, at)
    assert below != above
    assert (two.position[[below, above, far], 0] == [0, 0, 2]).all()
    assert np.intersect1d(nodes.nodes[below], nodes.nodes[far]).size == 0
    assert two.copy[far] == two.copy[below]
