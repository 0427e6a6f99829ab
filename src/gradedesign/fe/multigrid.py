"""Multigrid for elasticity: quadratic to linear tets, then smoothed aggregation.

The levels are nested: a linear space is part of the quadratic one on the same tets, so the linear
stiffness is the exact Galerkin product, and below it aggregates of nodes move with six rigid
modes each (Vanek, Mandel and Brezina, Computing 56, 1996, p. 179; pyamg finds the aggregates). A
V-cycle in single precision with Chebyshev smoothing over inverted 3 by 3 diagonal blocks
(Adams, Brezina, Hu and Tuminaro, J. Comput. Phys. 188, 2003, p. 593) preconditions conjugate
gradients in double precision.

Fixed components never enter: the inverted diagonal blocks are zero there, so no constrained copy
of the matrix is made. Every choice is deterministic.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csc_matrix, diags
from scipy.sparse.linalg import splu

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.fe._multigrid_kernels import relax
from gradedesign.fe.aggregation import coarsen
from gradedesign.fe.assembly import assemble, assembly_pattern
from gradedesign.fe.block_rows import (
    BlockRows,
    SingleArray,
    inverted_diagonal,
    largest_eigenvalue,
    product,
    single_precision,
)
from gradedesign.fe.rigid_modes import rigid_body_modes
from gradedesign.fe.space import TetSpace, edge_ends, vertex_space
from gradedesign.fe.stiffness import Stiffness

log = logging.getLogger(__name__)

#: Steps of Chebyshev's iteration before and after the coarse correction.
SMOOTHING_STEPS = 3
#: The smoother damps eigenvalues from the largest down to the largest divided by this.
SMOOTHING_RANGE = 20.0
#: Unknowns at which coarsening stops and a factorisation takes over.
COARSEST = 1500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Level:
    """One level above the coarsest.

    Attributes
    ----------
    matrix : BlockRows
    keep : (n,) float32 array
        0 on fixed unknowns, 1 elsewhere.
    inverse : (n / b, b, b) float32 array
        Inverted diagonal blocks, zero where fixed.
    largest : float
        Safe estimate of the largest eigenvalue of the inverted diagonal times the matrix.
    prolong, restrict : BlockRows
        From the next coarser level and to it.
    coarse_keep : (n_coarse,) float32 array
    """

    matrix: BlockRows
    keep: SingleArray
    inverse: SingleArray
    largest: float
    prolong: BlockRows
    restrict: BlockRows
    coarse_keep: SingleArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hierarchy:
    """Levels from fine to coarse, and the solver of the coarsest.

    Attributes
    ----------
    levels : tuple of Level
    coarsest : callable
        Right-hand side to solution on the coarsest level.
    sizes : tuple of int
        Unknowns per level, the coarsest included.
    """

    levels: tuple[Level, ...]
    coarsest: Callable[[FloatArray], FloatArray]
    sizes: tuple[int, ...]


def build_hierarchy(
    space: TetSpace, stiffness: Stiffness, matrix: bsr_matrix, fixed: BoolArray
) -> Hierarchy:
    """Build the levels for a stiffness and a set of fixed components.

    Parameters
    ----------
    space : TetSpace
    stiffness : IsotropicStiffness or AnisotropicStiffness
        What `matrix` was assembled from.
    matrix : bsr_matrix
        Unconstrained, 3 by 3 blocks.
    fixed : (3, n) bool array

    Returns
    -------
    Hierarchy
    """
    levels = []
    keep = (~fixed.T).ravel().astype(np.float64)
    if space.order == 2:
        linear = vertex_space(space)
        prolongation = _edge_interpolation(space)
        coarse_keep = keep[: linear.dof_count]
        levels.append(_level(matrix, keep, prolongation, coarse_keep))
        matrix, keep, space = (
            assemble(assembly_pattern(linear), stiffness),
            coarse_keep,
            linear,
        )
    candidates = rigid_body_modes(space.nodes).reshape(-1, 6) * keep[:, None]
    while matrix.shape[0] > COARSEST:
        inverse = inverted_diagonal(matrix, keep)
        largest = largest_eigenvalue(single_precision(matrix), keep, inverse)
        coarse = coarsen(matrix, keep, inverse, largest, candidates)
        if coarse is None:
            break
        levels.append(_level(matrix, keep, coarse.prolongation, coarse.keep, inverse, largest))
        matrix, keep, candidates = coarse.matrix, coarse.keep, coarse.candidates
    sizes = (*(lv.keep.size for lv in levels), matrix.shape[0])
    log.info("multigrid levels of %s unknowns", ", ".join(map(str, sizes)))
    return Hierarchy(levels=tuple(levels), coarsest=_factorised(matrix, keep), sizes=sizes)


def preconditioner(hierarchy: Hierarchy) -> Callable[[FloatArray], FloatArray]:
    """One V-cycle from a zero start, as a function of the residual.

    The function owns its scratch vectors: it serves one solve at a time.
    """
    scratch = [tuple(np.zeros(size, np.float32) for _ in range(4)) for size in hierarchy.sizes]

    def apply(residual: FloatArray) -> FloatArray:
        # Single precision covers 1e-38 to 1e38; scaling keeps tiny residuals away from its ends.
        scale = float(np.abs(residual).max())
        if scale == 0.0:
            return np.zeros_like(residual)
        x, f, _, _ = scratch[0]
        np.divide(residual, scale, out=f, casting="same_kind")
        _cycle(hierarchy, scratch, 0)
        return x.astype(np.float64) * scale

    return apply


def _cycle(hierarchy: Hierarchy, scratch: list[tuple[Any, ...]], depth: int) -> None:
    """Improve x of one level for its right-hand side f, from zero."""
    x, f, y, d = scratch[depth]
    if depth == len(hierarchy.levels):
        x[:] = hierarchy.coarsest(f.astype(np.float64))
        return
    level = hierarchy.levels[depth]
    x[:] = 0.0
    _smooth(level, x, f, y, d, from_zero=True)
    product(level.matrix, x, level.keep, 0.0, y)
    np.subtract(f, y, out=y)
    product(level.restrict, y, level.coarse_keep, 0.0, scratch[depth + 1][1])
    _cycle(hierarchy, scratch, depth + 1)
    product(level.prolong, scratch[depth + 1][0], level.keep, 1.0, x)
    _smooth(level, x, f, y, d, from_zero=False)


def _smooth(
    level: Level,
    x: SingleArray,
    f: SingleArray,
    y: SingleArray,
    d: SingleArray,
    *,
    from_zero: bool,
) -> None:
    """Chebyshev's iteration over the upper part of the spectrum.

    Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., algorithm 12.1.
    """
    smallest = level.largest / SMOOTHING_RANGE
    centre, half = (level.largest + smallest) / 2, (level.largest - smallest) / 2
    sigma = centre / half
    rho = 1.0 / sigma
    momentum, step = 0.0, 1.0 / centre
    for k in range(SMOOTHING_STEPS):
        if from_zero and k == 0:
            y[:] = 0.0
        else:
            product(level.matrix, x, level.keep, 0.0, y)
        if k > 0:
            new = 1.0 / (2.0 * sigma - rho)
            momentum, step = new * rho, 2.0 * new / half
            rho = new
        relax(level.inverse, f, y, momentum, step, d, x)


def _level(
    matrix: bsr_matrix,
    keep: FloatArray,
    prolongation: bsr_matrix,
    coarse_keep: FloatArray,
    inverse: SingleArray | None = None,
    largest: float | None = None,
) -> Level:
    """Collect a level, with its smoother if not given."""
    single = single_precision(matrix)
    if inverse is None:
        inverse = inverted_diagonal(matrix, keep)
    if largest is None:
        largest = largest_eigenvalue(single, keep, inverse)
    return Level(
        matrix=single,
        keep=keep.astype(np.float32),
        inverse=inverse,
        largest=largest,
        prolong=single_precision(prolongation),
        restrict=single_precision(prolongation.T.tobsr()),
        coarse_keep=coarse_keep.astype(np.float32),
    )


def _edge_interpolation(space: TetSpace) -> bsr_matrix:
    """Quadratic nodes from vertices: 1 at a vertex, one half of each end at an edge.

    One by one blocks stand for all three components.
    """
    ends = edge_ends(space)
    n, edges = space.mesh.points.shape[1], ends.shape[1]
    row = np.concatenate([np.arange(n), n + 2 * np.arange(edges + 1)])
    column = np.concatenate([np.arange(n), ends.T.ravel()])
    weight = np.concatenate([np.ones(n), np.full(2 * edges, 0.5)])
    return bsr_matrix((weight[:, None, None], column, row), shape=(n + edges, n))


def _factorised(matrix: bsr_matrix, keep: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Solver of the coarsest level; fixed and vanishing unknowns give zero."""
    diagonal = matrix.diagonal()
    live = (keep > 0.0) & (diagonal > 1e-12 * diagonal.max())
    mask = diags(live.astype(np.float64))
    # A shift far below single precision keeps rank-deficient aggregates from a zero pivot.
    filler = np.where(live, 1e-9 * diagonal, 1.0)
    factor = splu(
        csc_matrix(mask @ matrix.tocsr() @ mask + diags(filler)),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )

    def solve(f: FloatArray) -> FloatArray:
        return live * factor.solve(live * f)

    return solve
