"""Multigrid for elasticity: quadratic to linear tets, then smoothed aggregation.

The levels are nested: a linear space is part of the quadratic one on the same tets, so the linear
stiffness is the exact Galerkin product, and below it aggregates of nodes move with six rigid
modes each (Vanek, Mandel and Brezina, Computing 56, 1996, p. 179; pyamg finds the aggregates). A
W-cycle in single precision preconditions conjugate gradients in double precision. The quadratic
level is smoothed by Gauss-Seidel sweeps, up before the coarse correction and down after it, the
others by Chebyshev's iteration over inverted diagonal blocks (Adams, Brezina, Hu and Tuminaro,
J. Comput. Phys. 188, 2003, p. 593).

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
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.fe.assembly import assemble, assembly_pattern
from gradedesign.mechanics.fe.quadratic_level import QuadraticLevel, quadratic_level
from gradedesign.mechanics.fe.space import TetSpace, vertex_space
from gradedesign.mechanics.fe.stiffness import Stiffness, mean_stiffness
from gradedesign.mechanics.solver._order_kernels import add_midpoints, put_scaled, take_scaled
from gradedesign.mechanics.solver.aggregation import coarsen
from gradedesign.mechanics.solver.block_rows import (
    BlockRows,
    SingleArray,
    product,
    single_precision,
)
from gradedesign.mechanics.solver.chebyshev import Smoother, build_smoother, smooth
from gradedesign.mechanics.solver.rigid_modes import rigid_body_modes
from gradedesign.mechanics.solver.sweeps import sweep_down, sweep_up

log = logging.getLogger(__name__)

#: Steps of Chebyshev's iteration before and after the coarse correction on the level of linear tets
#: and below it, and the part of the spectrum it damps: from the largest eigenvalue down to the
#: largest divided by the second figure. Found on gyroid sheets: two visits of each coarser level (a
#: W-cycle) save a quarter of the iterations of one visit.
_LINEAR_SMOOTHING = (2, 12.0)
_COARSE_SMOOTHING = (3, 20.0)
#: Unknowns at which coarsening stops and a factorisation takes over. Chosen, not measured.
COARSEST = 1500


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Level:
    """One level of linear tets or aggregates, above the coarsest."""

    smoother: Smoother
    #: From the next coarser level and to it.
    prolong: BlockRows
    restrict: BlockRows
    #: ``(n_coarse,)`` float32. As the smoother's, for the next coarser level.
    coarse_keep: SingleArray

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.smoother.keep.size


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hierarchy:
    """Levels from fine to coarse, and the solver of the coarsest."""

    levels: tuple[QuadraticLevel | Level, ...]  #: The first may be quadratic.
    #: Right-hand sides ``(k, n)`` to solutions on the coarsest level.
    coarsest: Callable[[FloatArray], FloatArray]
    sizes: tuple[int, ...]  #: Unknowns per level, the coarsest included.


def build_hierarchy(
    space: TetSpace, stiffness: Stiffness, matrix: bsr_matrix, fixed: BoolArray
) -> Hierarchy:
    """Build the levels for a stiffness and a set of fixed components.

    ``stiffness``: what `matrix` was assembled from. ``matrix``: unconstrained, 3 by 3 blocks.
    ``fixed (3, n)``.
    """
    levels: list[QuadraticLevel | Level] = []
    keep = (~fixed.T).ravel().astype(np.float64)
    if space.order == 2:
        vertices = vertex_space(space)
        coarse_keep = keep[: vertices.dof_count]
        levels.append(quadratic_level(space, matrix, keep, coarse_keep))
        matrix, keep, space = (
            assemble(assembly_pattern(vertices), mean_stiffness(stiffness)),
            coarse_keep,
            vertices,
        )
    candidates = rigid_body_modes(space.nodes).reshape(-1, 6) * keep[:, None]
    while matrix.shape[0] > COARSEST:
        report_step(f"multigrid level of {matrix.shape[0]} unknowns")
        linear = matrix.blocksize == (3, 3)
        smoother = build_smoother(matrix, keep, _LINEAR_SMOOTHING if linear else _COARSE_SMOOTHING)
        coarse = coarsen(matrix, keep, smoother.inverse, smoother.largest, candidates)
        if coarse is None:
            break
        levels.append(_level(smoother, coarse.prolongation, coarse.keep))
        matrix, keep, candidates = coarse.matrix, coarse.keep, coarse.candidates
    sizes = (*(level.size for level in levels), matrix.shape[0])
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
        first = hierarchy.levels[0] if hierarchy.levels else None
        if isinstance(first, QuadraticLevel):
            z = np.zeros_like(residual)
            take_scaled(residual, first.sweeps.order, scale[:, 0], f)
            _quadratic_cycle(hierarchy, first, scratch)
            put_scaled(x, first.sweeps.order, scale[:, 0], z)
            return z
        np.divide(residual, scale, out=f, casting="same_kind")
        _cycle(hierarchy, scratch, 0, from_zero=True)
        return x.astype(np.float64) * scale

    return apply


def _quadratic_cycle(
    hierarchy: Hierarchy, level: QuadraticLevel, scratch: list[tuple[Any, ...]]
) -> None:
    """Set x of the quadratic level to a cycle from zero for its right-hand side f."""
    x, f, y, _ = scratch[0]
    sweep_up(level.sweeps, f, x, y)
    product(level.restrict, y, level.coarse_keep, 0.0, scratch[1][1])
    _visit(hierarchy, scratch, 1)
    add_midpoints(level.ends, level.sweeps.keep, scratch[1][0], x)
    sweep_down(level.sweeps, f, x, y)


def _visit(hierarchy: Hierarchy, scratch: list[tuple[Any, ...]], depth: int) -> None:
    """Two cycles of one level from zero; the coarsest is solved once."""
    _cycle(hierarchy, scratch, depth, from_zero=True)
    if depth < len(hierarchy.levels):
        _cycle(hierarchy, scratch, depth, from_zero=False)


def _cycle(
    hierarchy: Hierarchy, scratch: list[tuple[Any, ...]], depth: int, *, from_zero: bool
) -> None:
    """Improve x of one level for its right-hand side f; x need not be set if `from_zero`."""
    x, f, y, d = scratch[depth]
    if depth == len(hierarchy.levels):
        x[:] = hierarchy.coarsest(f.astype(np.float64))
        return
    level = hierarchy.levels[depth]
    if isinstance(level, QuadraticLevel):
        raise TypeError("only the first level may be quadratic")
    s = level.smoother
    if from_zero:
        x[:] = 0.0
    smooth(s, x, f, y, d, from_zero=from_zero)
    product(s.matrix, x, s.keep, 0.0, y)
    np.subtract(f, y, out=y)
    product(level.restrict, y, level.coarse_keep, 0.0, scratch[depth + 1][1])
    _visit(hierarchy, scratch, depth + 1)
    product(level.prolong, scratch[depth + 1][0], s.keep, 1.0, x)
    smooth(s, x, f, y, d, from_zero=False)


def _level(smoother: Smoother, prolongation: bsr_matrix, coarse_keep: FloatArray) -> Level:
    """Collect a level."""
    return Level(
        smoother=smoother,
        prolong=single_precision(prolongation),
        restrict=single_precision(prolongation.T.tobsr()),
        coarse_keep=coarse_keep.astype(np.float32),
    )


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
