"""Preconditioned conjugate gradients for a block-sparse matrix with fixed unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.solver._conjugate_kernels import descend, turn
from gradedesign.mechanics.solver._multigrid_kernels import multiply

#: The recursive residual drifts from the true one; the iteration restarts this often to mend it.
#: Chosen, not measured.
_RESTARTS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Iterate:
    """Last state of an iteration for k right-hand sides."""

    x: FloatArray  #: ``(k, n)``.
    iterations: IntArray  #: ``(k,)``.
    residual: FloatArray  #: ``(k,)``. True residual over the right-hand side.


def conjugate_gradients(
    matrix: bsr_matrix,
    keep: FloatArray,
    right: FloatArray,
    precondition: Callable[[FloatArray], FloatArray],
    *,
    rtol: float,
    max_iterations: int,
    start: FloatArray | None = None,
) -> Iterate:
    """Solve ``A x = right`` over the unknowns to keep; the others stay zero.

    Every right-hand side is iterated for itself; they only share each pass over the matrix. The new
    direction uses the change of the residual (Polak and Ribière), which tolerates a preconditioner
    that is symmetric to single precision only. Returns Iterate: converged or not: the caller judges
    the residual.

    - ``keep (n,)``: 1 for unknowns to solve for, 0 for fixed ones
    - ``right (k, n)``: zero where `keep` is
    - ``precondition``: residuals ``(k, n)`` to corrections
    - ``rtol``: residual at which to stop, over the right-hand side
    - ``max_iterations``: of each right-hand side
    - ``start (k, n)``: first guess, zero where `keep` is
    """
    x = np.zeros_like(right) if start is None else start.copy()
    size = norms(right)
    x[size == 0.0] = 0.0
    goal = rtol * size
    done = np.zeros(len(right), dtype=np.int64)
    for _ in range(1 + _RESTARTS):
        r = right - _product(matrix, keep, x)
        if not _iterate(matrix, keep, x, r, precondition, goal, done, max_iterations):
            break
    residual_norm = norms(right - _product(matrix, keep, x))
    return Iterate(
        x=x,
        iterations=done,
        residual=np.divide(residual_norm, size, out=np.zeros_like(size), where=size > 0),
    )


def _iterate(
    matrix: bsr_matrix,
    keep: FloatArray,
    x: FloatArray,
    r: FloatArray,
    precondition: Callable[[FloatArray], FloatArray],
    goal: FloatArray,
    done: IntArray,
    limit: int,
) -> bool:
    """Improve the rows of x in place until the residuals r that recur reach the goal.

    False where no row is left to improve.
    """
    active = (norms(r) > goal) & (done < limit)
    if not active.any():
        return False
    z = precondition(r)
    p = z.copy()
    rz = dots(r, z)
    q = np.zeros_like(x)
    first = norms(r)
    residual_norm = first.copy()
    while True:
        multiply(matrix.indptr, matrix.indices, matrix.data, p, keep, 0.0, q)
        curvature = dots(p, q)
        for k in np.flatnonzero(active):
            done[k] += 1
            if not (curvature[k] > 0.0 and rz[k] > 0.0):  # no descent left, or not a number
                active[k] = False
                continue
            alpha = rz[k] / curvature[k]
            residual_norm[k] = np.sqrt(descend(x[k], r[k], p[k], q[k], alpha))
            active[k] = residual_norm[k] > goal[k] and done[k] < limit
        if not active.any():
            return True
        report_step("multigrid", _share_done(first, residual_norm, goal, active))
        z = precondition(r)
        for k in np.flatnonzero(active):
            turn(p[k], z[k], -dots(z[k : k + 1], q[k : k + 1])[0] / curvature[k])
        rz = dots(r, z)


def _share_done(
    first: FloatArray, now: FloatArray, goal: FloatArray, active: BoolArray
) -> float | None:
    """Share of the digits of the least reduced residual that are won; None where none is due."""
    due = active & (first > goal) & (now > 0) & (goal > 0)
    if not due.any():
        return None
    won = np.log(first[due] / now[due]) / np.log(first[due] / goal[due])
    return float(np.clip(won.min(), 0.0, 1.0))


def dots(a: FloatArray, b: FloatArray) -> FloatArray:
    """Inner products of rows on one thread, whose order of summation never changes."""
    return np.array([np.einsum("i,i->", u, v) for u, v in zip(a, b, strict=True)])


def norms(a: FloatArray) -> FloatArray:
    """Euclidean lengths of rows, summed as `dots` does."""
    return np.sqrt(dots(a, a))


def _product(matrix: bsr_matrix, keep: FloatArray, x: FloatArray) -> FloatArray:
    """Product with the rows to keep."""
    y = np.zeros_like(x)
    multiply(matrix.indptr, matrix.indices, matrix.data, x, keep, 0.0, y)
    return y
