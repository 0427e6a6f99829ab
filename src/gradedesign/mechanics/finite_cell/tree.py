"""Coarse levels of multigrid: elements of eight elements, level upon level.

The stiffness of a coarse element is the Galerkin product of its children, so no geometry is
integrated again. Children of one parent that share no node become separate copies of the parent
with nodes of their own: walls that the void parts stay apart on every level.
"""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.fe.multigrid import Hierarchy, Level, factorised
from gradedesign.mechanics.finite_cell import _tree_kernels as kernels
from gradedesign.mechanics.solver.block_rows import BlockRows, inverted_diagonal, largest_eigenvalue
from gradedesign.mechanics.solver.chebyshev import Smoother

log = logging.getLogger(__name__)

#: Chebyshev steps, and the part of the spectrum they damp, on every level of the tree. As on the
#: coarse levels of `fe.multigrid`.
SMOOTHING = (3, 20.0)
#: Unknowns at which a factorisation takes over. Chosen, not measured.
COARSEST = 2500
#: Corners of a brick, x + 2 y + 4 z.
CORNERS = np.array([[c & 1, (c >> 1) & 1, c >> 2] for c in range(8)])


def tree_hierarchy(
    position: NDArray[np.int32],
    nodes: NDArray[np.int32],
    matrices: NDArray[np.float32],
    keep: NDArray[np.float32],
    slot: NDArray[np.int64],
    weights: NDArray[np.float32],
) -> Hierarchy:
    """Levels from linear bricks down to a factorised one.

    - ``position (n, 3)``
    - ``nodes (n, 8)``
    - ``matrices (n, 24, 24)``
    - ``keep (N, 3)``: 0 where a component is fixed
    - ``slot (n,)``: row of `weights` for every element
    - ``weights (k, 8, 8)``: functions of the corners of the next coarser element at the nodes of an
      element
    """
    levels = []
    while True:
        nodes = np.ascontiguousarray(nodes)
        first, element, local = kernels.elements_of_nodes(nodes, len(keep))
        row, column, blocks = _block_rows(nodes, matrices, first, element, local)
        n = len(keep)
        matrix = bsr_matrix((blocks, column, row), shape=(3 * n, 3 * n))
        flat = keep.ravel()
        if flat.size <= COARSEST or position.max() == 0:
            break
        parent_place, parent = _parents(position)
        copy = np.zeros(len(position), np.int32)
        count = kernels.connected_copies(parent, first, element, copy)
        place = np.zeros((count, 3), np.int32)
        place[copy] = parent_place[parent]
        coarse_nodes = np.zeros((count, 8), np.int32)
        coarse_count = kernels.coarse_nodes(copy, place, first, element, coarse_nodes)
        child = np.argsort(copy, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(copy, minlength=count))])
        coarse = np.zeros((count, 24, 24), np.float32)
        in_ranges(
            kernels.add_children, range(count), child, starts, slot, keep, nodes, matrices,
            weights, coarse,
        )  # fmt: skip
        matrices = coarse
        prolong = _prolongation(nodes, coarse_nodes, slot, copy, weights, (n, coarse_count))
        coarse_keep = _coarse_keep(prolong, keep)
        levels.append(_level(matrix, flat, prolong, coarse_keep))
        position, nodes, keep = place, coarse_nodes, coarse_keep
        slot, weights = slots_of(position), child_weights()
    return Hierarchy(
        levels=tuple(levels),
        coarsest=factorised(matrix.astype(np.float64), flat.astype(np.float64)),
        sizes=(*(lv.smoother.keep.size for lv in levels), flat.size),
    )


def _block_rows(
    nodes: NDArray[np.int32],
    matrices: NDArray[np.float32],
    first: NDArray[np.int64],
    element: NDArray[np.int32],
    local: NDArray[np.int8],
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float32]]:
    """Assemble 3 by 3 block rows: row starts, columns, blocks."""
    n = first.size - 1
    size = np.zeros(n + 1, np.int64)
    in_ranges(kernels.count_columns, range(n), nodes, first, element, size)
    row = np.cumsum(size)
    column = np.zeros(row[-1], np.int32)
    blocks = np.zeros((row[-1], 3, 3), np.float32)
    in_ranges(
        kernels.fill_rows, range(n), nodes, matrices, first, element, local, row, column, blocks
    )
    return row.astype(np.int32), column, blocks


def _parents(position: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Coarse elements that contain fine ones, and the coarse element of every fine one."""
    half = position >> 1
    dims = half.max(axis=0).astype(np.int64) + 1
    key = (half[:, 2] * dims[1] + half[:, 1]) * dims[0] + half[:, 0]
    keys, parent = np.unique(key, return_inverse=True)
    place = np.stack([keys % dims[0], keys // dims[0] % dims[1], keys // (dims[0] * dims[1])], 1)
    return place.astype(np.int32), parent


def slots_of(position: NDArray[np.int32]) -> NDArray[np.int64]:
    """Corner of the parent in which every element lies, as a row of `child_weights`."""
    return np.asarray((position & 1) @ np.array([1, 2, 4]))


def child_weights() -> NDArray[np.float32]:
    """Functions of a parent's corners at the corners of its children, ``(slot, child, parent)``."""
    at = (CORNERS[:, None] + CORNERS[None]) / 2.0
    return linear_shapes(np.moveaxis(at, -1, 0)).astype(np.float32)


def linear_shapes(places: FloatArray) -> FloatArray:
    """Values of the eight trilinear functions at reference points ``(3, ...)``, ``(..., 8)``."""
    t = np.asarray(places, dtype=np.float64)[..., None]
    return np.prod(np.where(CORNERS.T.reshape(3, *[1] * (t.ndim - 2), 8) == 1, t, 1.0 - t), axis=0)


def _prolongation(
    nodes: NDArray[np.int32],
    coarse_nodes: NDArray[np.int32],
    slot: NDArray[np.int64],
    copy: NDArray[np.int32],
    weights: NDArray[np.float32],
    shape: tuple[int, int],
) -> csr_matrix:
    """Values at nodes from those of the coarse level; one number for all components."""
    owner = np.zeros(shape[0], np.int64)
    local = np.zeros(shape[0], np.int64)
    for a in range(8):
        owner[nodes[:, a]] = np.arange(len(nodes))
        local[nodes[:, a]] = a
    w = weights[slot[owner], local]
    row, corner = np.nonzero(w)
    column = coarse_nodes[copy[owner[row]], corner]
    return csr_matrix((w[row, corner], (row, column)), shape=shape)


def _coarse_keep(prolong: csr_matrix, keep: NDArray[np.float32]) -> NDArray[np.float32]:
    """Components that stay free on the coarse level: nodes not on fixed fine nodes."""
    entries = prolong.tocoo()
    same = entries.data == 1.0
    coarse = np.ones((prolong.shape[1], 3), np.float32)
    coarse[entries.col[same]] = keep[entries.row[same]]
    return coarse


def rows_of(matrix: csr_matrix) -> BlockRows:
    """A transfer of one number for all components."""
    return BlockRows(
        row=matrix.indptr.astype(np.int32),
        column=matrix.indices.astype(np.int32),
        blocks=matrix.data.astype(np.float32)[:, None, None],
    )


def _inverse_diagonal(matrix: bsr_matrix, keep: NDArray[np.float32]) -> NDArray[np.float32]:
    """Inverted diagonal blocks, taken out first: a copy of all blocks in double is large."""
    n = len(matrix.indptr) - 1
    row = np.repeat(np.arange(n), np.diff(matrix.indptr))
    own = np.flatnonzero(matrix.indices == row)
    diagonal = bsr_matrix((matrix.data[own], np.arange(n), np.arange(n + 1)), shape=matrix.shape)
    return inverted_diagonal(diagonal, keep.astype(np.float64))


def _level(
    matrix: bsr_matrix,
    keep: NDArray[np.float32],
    prolong: csr_matrix,
    coarse_keep: NDArray[np.float32],
) -> Level:
    """Set up the smoother of one level and its transfers."""
    rows = BlockRows(row=matrix.indptr, column=matrix.indices, blocks=matrix.data)
    inverse = _inverse_diagonal(matrix, keep)
    return Level(
        smoother=Smoother(
            matrix=rows,
            keep=keep,
            inverse=inverse,
            largest=largest_eigenvalue(rows, keep.astype(np.float64), inverse),
            steps=SMOOTHING[0],
            span=SMOOTHING[1],
        ),
        prolong=rows_of(prolong),
        restrict=rows_of(prolong.T.tocsr()),
        coarse_keep=coarse_keep.ravel(),
    )
