"""Densities on a grid: exact interpolation, bounded and smooth spreading."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from gradedesign.errors import DensityError
from gradedesign.geometry.lattice.density_grid import (
    DensityGrid,
    density_grid_from_elements,
    evaluate,
)
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids, signed_volumes


def box_mesh(size, counts):
    """Six tetrahedra round the diagonal of every brick of a box."""
    lines = [np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)]
    points = np.array(np.meshgrid(*lines, indexing="ij")).reshape(3, -1)
    number = np.arange(points.shape[1]).reshape([n + 1 for n in counts])
    corner = [
        number[i : i + counts[0], j : j + counts[1], k : k + counts[2]].ravel()
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    ]
    paths = ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))
    tets = np.hstack([[corner[0], corner[a], corner[b], corner[7]] for a, b in paths])
    flipped = signed_volumes(TetMesh(points=points, tets=tets)) < 0
    tets[2:, flipped] = tets[[3, 2]][:, flipped]
    return TetMesh(points=points, tets=tets)


MESH = box_mesh((30.0, 12.0, 12.0), (10, 4, 4))


def grid_density_at_elements(grid, mesh):
    """Mean of a density grid inside every tetrahedron, by a 4-point rule.

    Of degree 2: Zienkiewicz and Taylor, The Finite Element Method, table of tetrahedral rules.
    """
    rule = np.full((4, 4), (5 - np.sqrt(5)) / 20)
    np.fill_diagonal(rule, (5 + 3 * np.sqrt(5)) / 20)
    return evaluate(grid, np.einsum("dcm,cq->dqm", mesh.points[:, mesh.tets], rule)).mean(axis=0)


def test_evaluate_equals_scipy_inside():
    rng = np.random.default_rng(11)
    values = rng.uniform(0.1, 0.9, size=(5, 4, 3))
    grid = DensityGrid(origin=[1.0, -2.0, 0.5], spacing=0.7, values=values)
    lines = [grid.origin[n] + 0.7 * np.arange(values.shape[n]) for n in range(3)]
    low, high = grid.origin, np.array([line[-1] for line in lines])
    points = low[:, None, None] + (high - low)[:, None, None] * rng.random((3, 40, 5))
    expected = RegularGridInterpolator(lines, values)(points.reshape(3, -1).T).reshape(40, 5)
    np.testing.assert_allclose(evaluate(grid, points), expected, rtol=1e-13)


def test_evaluate_is_constant_outside_and_exact_at_nodes():
    values = np.random.default_rng(12).uniform(0, 1, size=(3, 3, 3))
    grid = DensityGrid(origin=[0, 0, 0], spacing=2.0, values=values)
    points = np.array([[-5.0, 0, 0], [9, 9, 9], [2, 4, 0], [4, 4, 4]]).T
    expected = [values[0, 0, 0], values[2, 2, 2], values[1, 2, 0], values[2, 2, 2]]
    np.testing.assert_array_equal(evaluate(grid, points), expected)


def test_single_layer_of_nodes():
    grid = DensityGrid(origin=[0, 0, 0], spacing=1.0, values=[[[0.2]], [[0.4]]])
    assert evaluate(grid, np.array([0.25, 7.0, -1.0])) == pytest.approx(0.25)


def test_constant_stays_constant():
    rho = np.full(MESH.tets.shape[1], 0.37)
    grid = density_grid_from_elements(MESH, rho, spacing=1.5, margin=2.0)
    np.testing.assert_allclose(grid.values, 0.37, rtol=1e-12)
    np.testing.assert_allclose(grid_density_at_elements(grid, MESH), 0.37, rtol=1e-12)


def test_no_value_leaves_the_range():
    """Densities of either bound only."""
    rho = np.random.default_rng(13).choice([0.1, 0.65], size=MESH.tets.shape[1])
    grid = density_grid_from_elements(MESH, rho, spacing=1.0, margin=3.0)
    assert grid.values.min() >= 0.1
    assert grid.values.max() <= 0.65
    assert np.ptp(grid.values) > 0.3


def test_linear_density_comes_back():
    """A gradient of 0.4 over the length: within a third of an element's change, mean within 1 %."""
    rho = 0.15 + 0.4 * centroids(MESH)[0] / 30
    grid = density_grid_from_elements(MESH, rho, spacing=1.0, margin=1.0)
    back = grid_density_at_elements(grid, MESH)
    assert np.abs(back - rho).max() < 0.4 / 30 * 3.0 / 3
    volume = signed_volumes(MESH)
    assert np.average(back, weights=volume) == pytest.approx(
        np.average(rho, weights=volume), rel=1e-2
    )


def test_grid_is_continuous_across_a_jump():
    """A jump between elements of 3 mm: steps of 0.3 mm stay below 20 % of it and shrink."""
    mesh = box_mesh((12.0, 6.0, 6.0), (4, 2, 2))
    rho = np.where(centroids(mesh)[0] < 6, 0.2, 0.6)
    steps = [
        np.abs(np.diff(density_grid_from_elements(mesh, rho, spacing=h, margin=0).values, axis=0))
        for h in (0.3, 0.15)
    ]
    assert steps[0].max() < 0.20 * 0.4
    assert steps[1].max() < 0.7 * steps[0].max()


def test_four_point_rule_is_exact_for_quadratics():
    """Mean of x^2 over a tetrahedron is (sum x_i^2 + (sum x_i)^2) / 20."""
    mesh = TetMesh(points=[[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]], tets=[[0], [1], [2], [3]])
    axis = np.linspace(0, 1, 201)
    square = np.broadcast_to((axis**2)[:, None, None], (201, 2, 2))
    grid = DensityGrid(origin=[0, 0, 0], spacing=0.005, values=square)
    assert grid_density_at_elements(grid, mesh)[0] == pytest.approx(2 / 20, rel=1e-4)


def test_margin_is_covered():
    grid = density_grid_from_elements(
        MESH, np.full(MESH.tets.shape[1], 0.3), spacing=2.0, margin=5.0
    )
    np.testing.assert_array_equal(grid.origin, -5.0)
    end = grid.origin + 2.0 * (np.array(grid.values.shape) - 1)
    assert (end >= np.array([35, 17, 17]) - 1e-9).all()


def test_bad_densities_are_refused():
    with pytest.raises(DensityError, match="one finite value for each of 960"):
        density_grid_from_elements(MESH, np.ones(5), spacing=1.0, margin=0.0)
    with pytest.raises(DensityError, match=r"range from 0\.2 to 1\.3"):
        DensityGrid(origin=[0, 0, 0], spacing=1.0, values=[[[0.2, 1.3]]])
    with pytest.raises(DensityError, match="positive spacing"):
        density_grid_from_elements(MESH, np.full(960, 0.3), spacing=0.0, margin=0.0)
