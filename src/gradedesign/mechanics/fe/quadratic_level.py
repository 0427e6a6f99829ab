"""The level of quadratic tets of the multigrid solver, and its transfers to linear tets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe.space import TetSpace, edge_ends
from gradedesign.mechanics.solver.block_rows import BlockRows, SingleArray, single_precision
from gradedesign.mechanics.solver.sweeps import Sweeps, build_sweeps


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuadraticLevel:
    """The level of quadratic tets, in an order of its own; the next one is of linear tets."""

    sweeps: Sweeps
    #: ``(2, n)`` int32. Vertices at the ends of the edge of every node, twice the same at a vertex.
    ends: NDArray[np.int32]
    restrict: BlockRows
    #: ``(n_coarse,)`` float32. 0 on fixed unknowns of the next coarser level, 1 elsewhere.
    coarse_keep: SingleArray

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.sweeps.keep.size


def quadratic_level(
    space: TetSpace, matrix: bsr_matrix, keep: FloatArray, coarse_keep: FloatArray
) -> QuadraticLevel:
    """Set up sweeps and transfers of the quadratic level."""
    sweeps = build_sweeps(matrix, keep, space.nodes)
    vertices = np.arange(space.mesh.points.shape[1], dtype=np.int32)
    ends = np.concatenate([np.stack([vertices, vertices]), edge_ends(space)], axis=1)
    ends = np.ascontiguousarray(ends[:, sweeps.order])
    return QuadraticLevel(
        sweeps=sweeps,
        ends=ends,
        restrict=single_precision(edge_means(ends, vertices.size).T.tobsr((1, 1))),
        coarse_keep=coarse_keep.astype(np.float32),
    )


def edge_means(ends: NDArray[np.int32], vertices: int) -> csr_matrix:
    """Quadratic nodes from vertices: the mean of the two ends of an edge, or the vertex itself.

    One row per node stands for all three components.
    """
    n = ends.shape[1]
    half, start = np.full(2 * n, 0.5), 2 * np.arange(n + 1)
    means = csr_matrix((half, ends.T.ravel(), start), shape=(n, vertices))
    means.sum_duplicates()
    return means
