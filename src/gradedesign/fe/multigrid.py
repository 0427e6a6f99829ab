"""Multigrid for elasticity: quadratic to linear tets, then smoothed aggregation.

The levels are nested: a linear space is part of the quadratic one on the same tets, so the linear
stiffness is the exact Galerkin product, and below it aggregates of nodes move with six rigid
modes each (Vanek, Mandel and Brezina, Computing 56, 1996, p. 179; pyamg finds the aggregates). A
W-cycle in single precision with Chebyshev smoothing over inverted 3 by 3 diagonal blocks
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
from gradedesign.workspace.progress import report_step

log = logging.getLogger(__name__)

#: Steps of Chebyshev's iteration before and after the coarse correction on the finest level and
#: below it, and the part of the spectrum it damps: from the largest eigenvalue down to the largest
#: divided by the second figure. Found on gyroid sheets, where most of the time goes to the finest
#: level: two visits of each coarser level (a W-cycle) save 40 % of it over one visit.
FINEST_SMOOTHING = (2, 12.0)
COARSE_SMOOTHING = (3, 20.0)
#: Unknowns at which coarsening stops and a factorisation takes over.
COARSEST = 1500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Smoother:
    """Chebyshev's iteration for one matrix.

    Attributes
    ----------
    matrix : BlockRows
    keep : (n,) float32 array
        0 on fixed unknowns, 1 elsewhere.
    inverse : (n / b, b, b) float32 array
        Inverted diagonal blocks, zero where fixed.
    largest : float
        Safe estimate of the largest eigenvalue of the inverted diagonal times the matrix.
    steps : int
    span : float
        Eigenvalues from `largest` down to `largest` / `span` are damped.
    """

    matrix: BlockRows
    keep: SingleArray
    inverse: SingleArray
    largest: float
    steps: int
    span: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Level:
    """One level above the coarsest.

    Attributes
    ----------
    smoother : Smoother
    prolong, restrict : BlockRows
        From the next coarser level and to it.
    coarse_keep : (n_coarse,) float32 array
        As the smoother's, for the next coarser level.
    """

    smoother: Smoother
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
        Right-hand sides ``(k, n)`` to solutions on the coarsest level.
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
    stiffness : Stiffness
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
        smoother = _smoother(matrix, keep, FINEST_SMOOTHING)
        levels.append(_level(smoother, prolongation, coarse_keep))
        matrix, keep, space = (
            assemble(assembly_pattern(linear), stiffness),
            coarse_keep,
            linear,
        )
    candidates = rigid_body_modes(space.nodes).reshape(-1, 6) * keep[:, None]
    while matrix.shape[0] > COARSEST:
        report_step(f"multigrid level of {matrix.shape[0]} unknowns")
        smoother = _smoother(matrix, keep, COARSE_SMOOTHING if levels else FINEST_SMOOTHING)
        coarse = coarsen(matrix, keep, smoother.inverse, smoother.largest, candidates)
        if coarse is None:
            break
        levels.append(_level(smoother, coarse.prolongation, coarse.keep))
        matrix, keep, candidates = coarse.matrix, coarse.keep, coarse.candidates
    sizes = (*(lv.smoother.keep.size for lv in levels), matrix.shape[0])
    log.info("multigrid levels of %s unknowns", ", ".join(map(str, sizes)))
    return Hierarchy(levels=tuple(levels), coarsest=factorised(matrix, keep), sizes=sizes)


def preconditioner(hierarchy: Hierarchy, columns: int) -> Callable[[FloatArray], FloatArray]:
    """One W-cycle from a zero start, as a function of residuals ``(columns, n)``.

    The function owns its scratch vectors: it serves one solve at a time.
    """
    scratch = [
        tuple(np.zeros((columns, size), np.float32) for _ in range(4)) for size in hierarchy.sizes
    ]

    def apply(residual: FloatArray) -> FloatArray:
        # Single precision covers 1e-38 to 1e38; scaling keeps tiny residuals away from its ends.
        scale = np.maximum(residual.max(axis=1), -residual.min(axis=1))[:, None]
        scale[scale == 0.0] = 1.0
        x, f, _, _ = scratch[0]
        np.divide(residual, scale, out=f, casting="same_kind")
        _cycle(hierarchy, scratch, 0, from_zero=True)
        return x.astype(np.float64) * scale

    return apply


def _cycle(
    hierarchy: Hierarchy, scratch: list[tuple[Any, ...]], depth: int, *, from_zero: bool
) -> None:
    """Improve x of one level for its right-hand side f; x need not be set if `from_zero`."""
    x, f, y, d = scratch[depth]
    if depth == len(hierarchy.levels):
        x[:] = hierarchy.coarsest(f.astype(np.float64))
        return
    level, s = hierarchy.levels[depth], hierarchy.levels[depth].smoother
    if from_zero:
        x[:] = 0.0
    _smooth(s, x, f, y, d, from_zero=from_zero)
    product(s.matrix, x, s.keep, 0.0, y)
    np.subtract(f, y, out=y)
    product(level.restrict, y, level.coarse_keep, 0.0, scratch[depth + 1][1])
    _cycle(hierarchy, scratch, depth + 1, from_zero=True)
    if depth + 1 < len(hierarchy.levels):
        _cycle(hierarchy, scratch, depth + 1, from_zero=False)
    product(level.prolong, scratch[depth + 1][0], s.keep, 1.0, x)
    _smooth(s, x, f, y, d, from_zero=False)


def _smooth(
    s: Smoother,
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
    smallest = s.largest / s.span
    centre, half = (s.largest + smallest) / 2, (s.largest - smallest) / 2
    sigma = centre / half
    rho = 1.0 / sigma
    momentum, step = 0.0, 1.0 / centre
    for k in range(s.steps):
        if from_zero and k == 0:
            y[:] = 0.0
        else:
            product(s.matrix, x, s.keep, 0.0, y)
        if k > 0:
            new = 1.0 / (2.0 * sigma - rho)
            momentum, step = new * rho, 2.0 * new / half
            rho = new
        relax(s.inverse, f, y, momentum, step, d, x)


def _smoother(matrix: bsr_matrix, keep: FloatArray, smoothing: tuple[int, float]) -> Smoother:
    """Set up Chebyshev's iteration."""
    single = single_precision(matrix)
    inverse = inverted_diagonal(matrix, keep)
    return Smoother(
        matrix=single,
        keep=keep.astype(np.float32),
        inverse=inverse,
        largest=largest_eigenvalue(single, keep, inverse),
        steps=smoothing[0],
        span=smoothing[1],
    )


def _level(smoother: Smoother, prolongation: bsr_matrix, coarse_keep: FloatArray) -> Level:
    """Collect a level."""
    return Level(
        smoother=smoother,
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


def factorised(matrix: bsr_matrix, keep: FloatArray) -> Callable[[FloatArray], FloatArray]:
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
        return np.asarray(live * factor.solve((live * f).T).T)

    return solve
