"""Density filters keep constants, mass-weighting and the unit range."""

import numpy as np
import pytest

from gradedesign import DensityError
from gradedesign.mechanics.sizing import filter as module
from gradedesign.mechanics.sizing.filter import collected, cone_filter, filtered, uniform_filter


def _cloud(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(20261)
    return rng.uniform(0, 10, (3, count)), rng.uniform(0.5, 2.0, count)


@pytest.fixture(params=["pairs", "grid"])
def way(request, monkeypatch):
    """Weights of every pair, or by a grid as where pairs are too many."""
    if request.param == "grid":
        _by_grid(monkeypatch)
    return request.param


def _by_grid(monkeypatch):
    monkeypatch.setattr(module, "MOST_PAIRS", 0)
    monkeypatch.setattr(module, "NODES_IN_RADIUS", 0)


def test_constants_pass_through(way):
    points, volumes = _cloud()
    cone = cone_filter(points, volumes, 2.5)
    assert cone.shape == (200, 200)
    assert len(cone.factors) == (1 if way == "pairs" else 3)
    np.testing.assert_allclose(filtered(cone, np.full(200, 0.3)), 0.3, rtol=1e-14)


@pytest.mark.parametrize("at_a_time", [1, 100, module.PAIRS_AT_A_TIME])
def test_matches_the_slow_loop(at_a_time, monkeypatch):
    monkeypatch.setattr(module, "PAIRS_AT_A_TIME", at_a_time)
    points, volumes = _cloud(60)
    radius = 3.0
    dense = np.zeros((60, 60))
    for i in range(60):
        for j in range(60):
            gap = np.linalg.norm(points[:, i] - points[:, j])
            dense[i, j] = max(0.0, radius - gap) * volumes[j]
        dense[i] /= dense[i].sum()
    (matrix,) = cone_filter(points, volumes, radius).factors
    np.testing.assert_allclose(matrix.toarray(), dense, atol=1e-14)


def test_a_grid_filters_smooth_fields_as_pairs_do(monkeypatch):
    """Trilinear weights on a grid of h = R / 6 widen a cone of radius R, at both ends, a little.

    The second moment of a trilinear hat along an axis is at most h^2 / 4, of both h^2 / 2 = R^2 /
    72; that of the cone 2 R^2 / 15. A wave with k R = pi / 2 keeps 1 - k^2 R^2 / 15 = 0.84 of its
    amplitude, on the grid at most k^2 R^2 / 144 = 0.017 less; beside faces twice that is allowed.
    """
    rng = np.random.default_rng(9)
    points, volumes = rng.uniform(0, 10, (3, 4000)), rng.uniform(0.5, 2.0, 4000)
    wave = np.sin(0.5 * np.pi * points[0] / 2.5)
    by_pairs = filtered(cone_filter(points, volumes, 2.5), wave)
    _by_grid(monkeypatch)
    by_grid = filtered(cone_filter(points, volumes, 2.5), wave)
    assert np.abs(by_grid - by_pairs).max() <= 0.034
    # In the mean over the middle, far from faces, the amplitude falls and the phase stays.
    middle = (np.abs(points - 5) < 2.5).all(axis=0)
    share = (by_grid * by_pairs)[middle].sum() / (by_pairs**2)[middle].sum()
    assert 1 - 0.017 / 0.84 <= share <= 1.0


def test_derivatives_are_those_of_the_densities(way):
    points, volumes = _cloud()
    rng = np.random.default_rng(8)
    cone = cone_filter(points, volumes, 3.0)
    x, by_density = rng.uniform(size=200), rng.normal(size=(2, 200))
    found = collected(cone, by_density)
    assert found.shape == (2, 200)
    # The adjoint: g . (H x) = (H^T g) . x.
    np.testing.assert_allclose(found @ x, by_density @ filtered(cone, x), rtol=1e-12)
    np.testing.assert_allclose(collected(cone, by_density[0]), found[0], rtol=1e-12)


def test_many_tetrahedra_within_the_radius_take_little_memory():
    """60,000 points within one radius: 3.6e9 pairs would take 43 GB."""
    points = np.random.default_rng(10).uniform(0, 1, (3, 60_000))
    cone = cone_filter(points, np.ones(60_000), 2.0)
    assert sum(factor.nnz for factor in cone.factors) < 20 * 60_000
    assert np.ptp(filtered(cone, points[0])) < 0.5


def test_no_grid_is_taken_that_has_more_pairs_of_nodes(monkeypatch):
    """200 points with 13 in the mean within the radius; a node has 925."""
    monkeypatch.setattr(module, "MOST_PAIRS", 0)
    assert len(cone_filter(*_cloud(), 2.5).factors) == 1


def test_nodes_of_the_grid_within_the_radius_are_counted():
    along = np.arange(-module.NODES_PER_RADIUS, module.NODES_PER_RADIUS + 1)
    square = sum(axis**2 for axis in np.meshgrid(along, along, along))
    assert np.count_nonzero(square <= module.NODES_PER_RADIUS**2) == module.NODES_IN_RADIUS


def test_result_stays_within_the_variables(way):
    points, volumes = _cloud()
    x = np.random.default_rng(77).uniform(0.1, 0.6, 200)
    rho = filtered(cone_filter(points, volumes, 4.0), x)
    assert x.min() <= rho.min() <= rho.max() <= x.max()


def test_uniform_filter_has_one_variable():
    np.testing.assert_array_equal(filtered(uniform_filter(5), np.array([0.4])), np.full(5, 0.4))


def test_radius_must_be_positive():
    points, volumes = _cloud(10)
    with pytest.raises(DensityError, match=r"0 mm"):
        cone_filter(points, volumes, 0.0)
