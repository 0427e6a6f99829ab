"""Smoothed aggregation: the next coarser level of a block matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pyamg.aggregation.aggregate import standard_aggregation
from pyamg.aggregation.tentative import fit_candidates
from scipy.sparse import bsr_matrix, csr_matrix

from gradedesign.arrays import FloatArray

#: Aggregation that leaves more than this share of the unknowns is not worth a level. Chosen, not
#: measured.
_SLOWEST_COARSENING = 0.7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoarseLevel:
    """A coarser problem and the way back."""

    matrix: bsr_matrix  #: Galerkin product, 6 by 6 blocks.
    prolongation: bsr_matrix
    keep: FloatArray  #: ``(n_coarse,)``. 0 for unknowns that stand for nothing, 1 elsewhere.
    candidates: FloatArray  #: ``(n_coarse, 6)``. Rigid modes on the coarse level.


def coarsen(
    matrix: bsr_matrix,
    keep: FloatArray,
    inverse: NDArray[np.float32],
    largest: float,
    candidates: FloatArray,
) -> CoarseLevel | None:
    """Aggregate nodes and smooth the rigid modes of the aggregates once.

    Vanek, Mandel and Brezina (1996), eq. 17 with block-Jacobi smoothing and damping
    4 / (3 largest eigenvalue).

    - ``keep (n,)``: 0 on fixed unknowns, 1 elsewhere
    - ``inverse (n / b, b, b)``: inverted diagonal blocks, zero where fixed
    - ``largest``: largest eigenvalue of the inverted diagonal times the matrix
    - ``candidates (n, 6)``: rigid modes, zero where fixed

    Returns
    -------
    CoarseLevel or None
        None if aggregation hardly reduces the problem.
    """
    aggregates, _ = standard_aggregation(_graph(matrix, keep))
    if 6 * aggregates.shape[1] > _SLOWEST_COARSENING * matrix.shape[0]:
        return None
    tentative, coarse_candidates = fit_candidates(aggregates, candidates)
    tentative = bsr_matrix(tentative)
    smoothing = bsr_matrix(matrix @ tentative)
    rows = np.repeat(np.arange(len(inverse)), np.diff(smoothing.indptr))
    smoothing.data = (-4.0 / (3.0 * largest)) * np.matmul(inverse[rows], smoothing.data)
    prolongation = bsr_matrix(tentative + smoothing)
    coarse = bsr_matrix(prolongation.T.tobsr() @ bsr_matrix(matrix @ prolongation))
    coarse.sort_indices()
    diagonal = coarse.diagonal()
    return CoarseLevel(
        matrix=coarse,
        prolongation=prolongation,
        keep=(diagonal > 1e-12 * diagonal.max()).astype(np.float64),
        candidates=coarse_candidates,
    )


def _graph(matrix: bsr_matrix, keep: FloatArray) -> csr_matrix:
    """Connections between nodes that can move, for aggregation."""
    block = matrix.blocksize[0]
    free = keep.reshape(-1, block).max(axis=1) > 0.0
    n = free.size
    rows = np.repeat(np.arange(n), np.diff(matrix.indptr))
    linked = free[rows] & free[matrix.indices]
    counts = np.bincount(rows[linked], minlength=n)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    column = matrix.indices[linked].astype(np.int32)
    return csr_matrix((np.ones(column.size), column, start), shape=(n, n))
