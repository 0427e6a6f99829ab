"""Density filters keep constants, mass-weighting and the unit range."""

import numpy as np
import pytest

from gradedesign import DensityError
from gradedesign.sizing.filter import cone_filter, uniform_filter


def _cloud(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(20261)
    return rng.uniform(0, 10, (3, count)), rng.uniform(0.5, 2.0, count)


def test_constants_pass_through():
    points, volumes = _cloud()
    matrix = cone_filter(points, volumes, 2.5)
    np.testing.assert_allclose(matrix @ np.full(200, 0.3), 0.3, rtol=1e-14)


def test_matches_the_slow_loop():
    points, volumes = _cloud(60)
    radius = 3.0
    dense = np.zeros((60, 60))
    for i in range(60):
        for j in range(60):
            gap = np.linalg.norm(points[:, i] - points[:, j])
            dense[i, j] = max(0.0, radius - gap) * volumes[j]
        dense[i] /= dense[i].sum()
    np.testing.assert_allclose(cone_filter(points, volumes, radius).toarray(), dense, atol=1e-14)


def test_result_stays_within_the_variables():
    points, volumes = _cloud()
    x = np.random.default_rng(77).uniform(0.1, 0.6, 200)
    rho = cone_filter(points, volumes, 4.0) @ x
    assert x.min() <= rho.min() <= rho.max() <= x.max()


def test_uniform_filter_has_one_variable():
    np.testing.assert_array_equal(uniform_filter(5) @ np.array([0.4]), np.full(5, 0.4))


def test_radius_must_be_positive():
    points, volumes = _cloud(10)
    with pytest.raises(DensityError, match=r"0 mm"):
        cone_filter(points, volumes, 0.0)
