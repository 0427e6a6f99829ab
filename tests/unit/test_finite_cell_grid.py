"""The grid of finite cells, its elements and weak supports."""

import numpy as np
import pytest

from gradedesign.errors import CaseError, LatticeError
from gradedesign.finite_cell import Plane
from gradedesign.finite_cell.elements import cut_elements, solid_volume
from gradedesign.finite_cell.grid import fit_grid


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


def test_volume_converges_with_second_order():
    exact = 4.0 / 3.0 * np.pi * 0.77**3
    errors = []
    for count in (4, 8, 16):
        elements = cut_elements(ball, fit_grid([-1] * 3, [1] * 3, 2 / count))
        errors.append(abs(solid_volume(elements) / exact - 1.0))
        points = elements.share.sum(axis=1)
        np.testing.assert_allclose(points, elements.weights.sum(axis=1), atol=1e-6)
    assert errors[2] < 1e-3
    assert np.log2(errors[0] / errors[2]) / 2 == pytest.approx(2.0, abs=0.1)


def test_cut_elements_integrate_polynomials_over_a_half_space():
    normal = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)

    def half(points):
        return np.einsum("d,d...->...", normal, points) - 0.1

    moments = []
    for subcells in (4, 12):
        grid = fit_grid([-1] * 3, [1] * 3, 0.5)
        elements = cut_elements(half, grid, subcells=subcells)
        from gradedesign.finite_cell.basis import gauss_places

        places = gauss_places(5)[:, None] + elements.position[elements.whole :].T[:, :, None]
        x, y, z = grid.lower[:, None, None] + grid.edges[:, None, None] * places
        moments.append([(elements.weights * f).sum() for f in (x**0, x * y**2 * z**2, x**2 * y)])
    # Degree 6 on the cut triangles is exact; finer sub-cells must not change it.
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
