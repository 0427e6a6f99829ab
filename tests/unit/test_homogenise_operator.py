"""The matrix-free product, its homogeneous inverse and the pieces of a periodic grid."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gradedesign.errors import LatticeError, SolverError
from gradedesign.mechanics.homogenise.constants import solid_stiffness
from gradedesign.mechanics.homogenise.islands import connected_fill
from gradedesign.mechanics.homogenise.operator import (
    homogeneous_inverse,
    node_scale,
    precondition,
    voxel_operator,
)

CORNERS = list(itertools.product((0, 1), repeat=3))


def hexahedron(nu: float) -> np.ndarray:
    """Stiffness of the unit cube by 2x2x2 Gauss points; unknown 3 * corner + component."""
    gauss = [0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5]
    k = np.zeros((24, 24))
    for p in itertools.product(gauss, repeat=3):
        b = np.zeros((6, 24))
        for a, corner in enumerate(CORNERS):
            shape = [p[d] if corner[d] else 1 - p[d] for d in range(3)]
            sign = [1.0 if corner[d] else -1.0 for d in range(3)]
            x, y, z = (
                sign[0] * shape[1] * shape[2],
                sign[1] * shape[0] * shape[2],
                sign[2] * shape[0] * shape[1],
            )
            b[:, 3 * a : 3 * a + 3] = [
                [x, 0, 0], [0, y, 0], [0, 0, z], [0, z, y], [z, 0, x], [y, x, 0],
            ]  # fmt: skip
        k += b.T @ solid_stiffness(nu) @ b / 8
    return k


def slow_product(fill: np.ndarray, u: np.ndarray, nu: float) -> np.ndarray:
    """Loop over voxels with the dense stiffness."""
    k, y = hexahedron(nu), np.zeros_like(u)
    for voxel in np.ndindex(*fill.shape):
        nodes = [tuple((voxel[d] + c[d]) % fill.shape[d] for d in range(3)) for c in CORNERS]
        force = fill[voxel] * k @ np.array([u[(slice(None), *n)] for n in nodes]).ravel()
        for a, n in enumerate(nodes):
            y[(slice(None), *n)] += force[3 * a : 3 * a + 3]
    return y


# Shapes: fewer planes than slabs, rows longer than the buffer, odd sizes, the least possible.
@pytest.mark.parametrize("shape", [(5, 3, 7), (2, 2, 2), (3, 4, 150), (19, 3, 2)])
@pytest.mark.parametrize("nu", [0.3, 0.0])
def test_product_equals_the_loop_over_dense_voxels(shape, nu) -> None:
    rng = np.random.default_rng(11)
    fill = rng.uniform(size=shape) * (rng.uniform(size=shape) < 0.6)
    u = rng.standard_normal((3, *shape))
    y = np.full_like(u, np.nan)
    voxel_operator(fill, nu).product(u, y)
    np.testing.assert_allclose(y, slow_product(fill, u, nu), atol=1e-13)


def test_translation_costs_no_force() -> None:
    rng = np.random.default_rng(12)
    fill = rng.uniform(size=(6, 5, 4))
    u = np.ones((3, 6, 5, 4)) * np.array([1.0, -2.0, 0.5])[:, None, None, None]
    y = np.zeros_like(u)
    voxel_operator(fill, 0.3).product(u, y)
    assert np.abs(y).max() < 1e-14


def test_inverse_undoes_the_homogeneous_operator() -> None:
    # Single precision: 1e-6 of the values, which are of order one.
    shape = (6, 5, 8)
    rng = np.random.default_rng(13)
    u = rng.standard_normal((3, *shape))
    u -= u.mean(axis=(1, 2, 3), keepdims=True)
    force = np.zeros_like(u)
    voxel_operator(np.ones(shape), 0.3).product(u, force)
    again = precondition(force.astype(np.float32), homogeneous_inverse(shape, 0.3))
    np.testing.assert_allclose(again, u, atol=2e-5)


def test_scale_is_one_on_solid_and_void_alone() -> None:
    fill = np.zeros((4, 4, 4))
    fill[:2] = 1.0
    scale = node_scale(fill)
    assert set(np.unique(scale).tolist()) == {0.0, 1.0}
    fill[2, 0, 0] = 0.5
    # A node inside the solid keeps 1; one with all 8 neighbours but none solid has none.
    assert node_scale(fill)[1, 1, 1] == 1.0
    assert node_scale(fill)[0, 1, 1] == pytest.approx(0.5**-0.25)


@pytest.mark.parametrize("value", [-0.1, 1.2, np.nan])
def test_impossible_fills_are_refused(value) -> None:
    fill = np.ones((3, 3, 3))
    fill[0, 0, 0] = value
    with pytest.raises(SolverError, match="fill of the voxels"):
        voxel_operator(fill, 0.3)


def test_impossible_poisson_ratio_is_refused() -> None:
    with pytest.raises(SolverError, match=r"Poisson ratio 0\.5"):
        voxel_operator(np.ones((3, 3, 3)), 0.5)


def bars(n: int = 20) -> np.ndarray:
    """Three bars along the axes through one corner: one piece, joined over the boundary."""
    fill = np.zeros((n, n, n))
    fill[:, :4, :4] = fill[:4, :, :4] = fill[:4, :4, :] = 1.0
    return np.roll(fill, (-2, -2, -2), (0, 1, 2))


def test_a_connected_grid_is_left_alone() -> None:
    fill, share = connected_fill(bars())
    assert share == 0.0
    np.testing.assert_array_equal(fill, bars())


def test_a_loose_voxel_is_removed_and_reported() -> None:
    grid = np.tile(bars(), (2, 2, 2))
    loose = grid.copy()
    loose[11, 11, 11] = 1.0
    fill, share = connected_fill(loose)
    np.testing.assert_array_equal(fill, grid)
    assert share == pytest.approx(1 / loose.sum())


def test_a_large_loose_piece_is_refused() -> None:
    grid = bars()
    grid[8:12, 8:12, 8:12] = 1.0
    with pytest.raises(LatticeError, match="not connected to the rest"):
        connected_fill(grid)


def test_a_plate_carries_no_load_across() -> None:
    grid = np.zeros((8, 8, 8))
    grid[3:5] = 1.0
    with pytest.raises(LatticeError, match="three directions"):
        connected_fill(grid)


def test_a_diagonal_strut_winds_in_one_direction_only() -> None:
    # It touches all six faces of the cell, but its copies form separate lines along (1, 1, 1).
    n = 12
    i = np.arange(n)
    grid = np.zeros((n, n, n))
    grid[i, i, i] = grid[(i + 1) % n, i, i] = grid[(i + 1) % n, (i + 1) % n, i] = 1.0
    with pytest.raises(LatticeError, match="three directions"):
        connected_fill(grid)


def test_an_empty_grid_is_refused() -> None:
    with pytest.raises(LatticeError, match="empty"):
        connected_fill(np.zeros((4, 4, 4)))
