"""Density filters: from design variables to the density of every tetrahedron."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError

log = logging.getLogger(__name__)

#: Pairs of tetrahedra within a radius of each other up to which the cone's weights are kept for
#: every pair: 12 bytes each, twice that while they are found.
MOST_PAIRS = 50_000_000
#: Pairs that are found at a time, each of which takes about 60 bytes until its weight is stored.
PAIRS_AT_A_TIME = 2_000_000
#: Nodes of a grid along the radius that stand for tetrahedra where there are more pairs. Chosen,
#: not measured.
NODES_PER_RADIUS = 6
#: Nodes of that grid within the radius of one of them.
NODES_IN_RADIUS = 925
#: Tetrahedra whose neighbours are counted to tell the number of pairs, evenly among them. Chosen,
#: not measured.
_COUNTED = 500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DensityFilter:
    """A linear map ``rho = H x`` from n design variables to M densities, as a product."""

    factors: tuple[csr_matrix, ...]  #: H is their product, the first one applied last.

    @property
    def shape(self) -> tuple[int, int]:
        """Densities and variables, ``(M, n)``."""
        return self.factors[0].shape[0], self.factors[-1].shape[1]


def filtered(density_filter: DensityFilter, x: FloatArray) -> FloatArray:
    """Densities ``(M,)`` of design variables ``(n,)``."""
    for factor in reversed(density_filter.factors):
        x = factor @ x
    return np.asarray(x)


def collected(density_filter: DensityFilter, by_density: FloatArray) -> FloatArray:
    """Derivatives by every variable ``(..., n)`` of derivatives by every density ``(..., M)``."""
    rows = np.atleast_2d(by_density).T
    for factor in density_filter.factors:
        rows = factor.T @ rows
    return np.asarray(rows.T).reshape(*by_density.shape[:-1], density_filter.shape[1])


def cone_filter(
    points: FloatArray, volumes: FloatArray, radius: float, at: FloatArray | None = None
) -> DensityFilter:
    """Row-stochastic filter with linearly falling, volume-weighted kernel.

    Where more pairs of tetrahedra than `MOST_PAIRS` lie within the radius of each other, volumes
    are spread to the nodes of a grid of a sixth of the radius, the cone is taken between nodes, and
    densities are interpolated from these, if there are fewer pairs of nodes: memory then grows with
    the volume of the part over the cube of the radius, not with the square of its tetrahedra.
    Returns DensityFilter: of M variables.

    - ``points (3, M)``, mm: centroids
    - ``volumes (M,)``, mm^3
    - ``radius``, mm: where the kernel reaches zero
    - ``at (3, k)``, mm: points at which values are wanted; the centroids by default. One with no
      centroid within the radius takes the value of the nearest.

    References
    ----------
    T. E. Bruns, D. A. Tortorelli, Comput. Methods Appl. Mech. Eng. 190, 2001.
    """
    if not radius > 0:
        raise DensityError(f"filter radius is {radius:g} mm, expected a positive length")
    tree = cKDTree(points.T)
    some = points[:, :: max(points.shape[1] // _COUNTED, 1)].T
    pairs = tree.query_ball_point(some, radius, return_length=True).mean() * points.shape[1]
    ends, count = points if at is None else at, points.shape[1]
    pairs *= ends.shape[1] / count
    if pairs <= MOST_PAIRS:
        return _between_points(points, volumes, radius, at)
    both = np.concatenate([points, ends], axis=1)
    nodes, weights = _grid_weights(both, radius / NODES_PER_RADIUS)
    if pairs <= NODES_IN_RADIUS * nodes.shape[1]:
        return _between_points(points, volumes, radius, at)
    log.info("densities are filtered on %d nodes of a grid", nodes.shape[1])
    spread = csr_matrix(weights[:count].T @ diags(volumes))
    between = _cone(nodes, np.ones(nodes.shape[1]), radius)
    sums = weights[count:] @ (between @ (spread @ np.ones(count)))
    return DensityFilter(factors=(csr_matrix(diags(1.0 / sums) @ weights[count:]), between, spread))


def cone_mean(
    points: FloatArray, volumes: FloatArray, radius: float, values: FloatArray, at: FloatArray
) -> FloatArray:
    """The mean by the kernel of `cone_filter` about any points, ``(k,)``; 0 where none is near.

    - ``points (3, M)``, mm
    - ``volumes (M,)``, mm^3
    - ``radius``, mm
    - ``values (M,)``
    - ``at (3, k)``, mm
    """
    tree, mean = cKDTree(points.T), np.zeros(at.shape[1])
    weighted = np.stack([volumes, volumes * values], axis=1)
    for block in _blocks(tree, at, radius):
        pairs = cKDTree(at[:, block].T).sparse_distance_matrix(
            tree, radius, output_type="coo_matrix"
        )
        kernel = csr_matrix((radius - pairs.data, (pairs.row, pairs.col)), shape=pairs.shape)
        below, above = (kernel @ weighted).T
        np.divide(above, below, out=mean[block], where=below > 0)
    return mean


def uniform_filter(count: int) -> DensityFilter:
    """Filter of one variable: every tetrahedron has the same density."""
    return DensityFilter(factors=(csr_matrix(np.ones((count, 1))),))


def _between_points(
    points: FloatArray, volumes: FloatArray, radius: float, at: FloatArray | None
) -> DensityFilter:
    """Filter that keeps the weights of every pair of points."""
    kernel = _cone(points, volumes, radius, at)
    alone = np.flatnonzero(_sums(kernel) <= 0)
    if at is not None and alone.size:
        nearest = cKDTree(points.T).query(at[:, alone].T)[1]
        kernel = kernel + csr_matrix((np.ones(alone.size), (alone, nearest)), shape=kernel.shape)
    kernel.data *= np.repeat(1.0 / _sums(kernel), np.diff(kernel.indptr))
    return DensityFilter(factors=(kernel,))


def _cone(
    points: FloatArray, volumes: FloatArray, radius: float, at: FloatArray | None = None
) -> csr_matrix:
    """Weights ``(radius - distance) volume`` of points within the radius of every one of ``at``."""
    tree, ends = cKDTree(points.T), points if at is None else at
    rows = []
    for block in _blocks(tree, ends, radius):
        within = cKDTree(ends[:, block].T)
        pairs = within.sparse_distance_matrix(tree, radius, output_type="coo_matrix").tocsr()
        pairs.data = (radius - pairs.data) * volumes[pairs.indices]
        rows.append(pairs)
    kernel = csr_matrix(vstack(rows, format="csr"))
    if at is not None:
        return kernel
    # The distance matrix drops the zero distance of a point to itself.
    return csr_matrix(kernel + diags(radius * volumes - kernel.diagonal(), shape=kernel.shape))


def _blocks(tree: cKDTree, points: FloatArray, radius: float) -> list[slice]:
    """Successive points with about `PAIRS_AT_A_TIME` pairs, at least one point each."""
    counts = tree.query_ball_point(points.T, radius, return_length=True)
    number = np.cumsum(counts) // PAIRS_AT_A_TIME
    ends = [*(np.flatnonzero(np.diff(number)) + 1), points.shape[1]]
    return [slice(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def _sums(matrix: csr_matrix) -> FloatArray:
    """Sum of every row."""
    return np.asarray(matrix.sum(axis=1)).ravel()


def _grid_weights(points: FloatArray, spacing: float) -> tuple[FloatArray, csr_matrix]:
    """Nodes ``(3, g)`` of the cubes of a grid that hold points, and trilinear weights (M, g)."""
    origin = points.min(axis=1) - 0.5 * spacing
    place = (points - origin[:, None]) / spacing
    cube = np.floor(place).astype(np.int64)
    share = place - cube
    shape = cube.max(axis=1) + 2
    rows, columns, values = [], [], []
    for corner in np.ndindex(2, 2, 2):
        at = np.array(corner)[:, None]
        columns.append(np.ravel_multi_index(tuple(cube + at), tuple(shape)))
        values.append(np.where(at == 1, share, 1.0 - share).prod(axis=0))
        rows.append(np.arange(points.shape[1]))
    used, column = np.unique(np.concatenate(columns), return_inverse=True)
    weights = csr_matrix(
        (np.concatenate(values), (np.concatenate(rows), column.ravel())),
        shape=(points.shape[1], used.size),
    )
    nodes = origin[:, None] + spacing * np.array(np.unravel_index(used, tuple(shape)))
    return nodes, weights
