"""Preconditioned conjugate gradients for a block-sparse matrix with fixed unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.fe._multigrid_kernels import multiply

#: The recursive residual drifts from the true one; the iteration restarts this often to mend it.
RESTARTS = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Iterate:
    """Where an iteration ended.

    Attributes
    ----------
    x : (n,) array
    iterations : int
    residual : float
        True residual over the right-hand side.
    """

    x: FloatArray
    iterations: int
    residual: float


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

    The new direction uses the change of the residual (Polak and Ribière), which tolerates a
    preconditioner that is symmetric to single precision only.

    Parameters
    ----------
    matrix : bsr_matrix
    keep : (n,) array
        1 for unknowns to solve for, 0 for fixed ones.
    right : (n,) array
        Zero where `keep` is.
    precondition : callable
        Residual to correction.
    rtol : float
        Residual at which to stop, over the right-hand side.
    max_iterations : int
    start : (n,) array, optional
        First guess, zero where `keep` is.

    Returns
    -------
    Iterate
        Converged or not: the caller judges the residual.
    """
    x = np.zeros_like(right) if start is None else start.copy()
    size = norm(right)
    if size == 0.0:
        return Iterate(x=np.zeros_like(right), iterations=0, residual=0.0)
    done = 0
    for _ in range(1 + RESTARTS):
        r = right - _product(matrix, keep, x)
        if norm(r) <= rtol * size or done >= max_iterations:
            break
        done += _iterate(matrix, keep, x, r, precondition, rtol * size, max_iterations - done)
    residual = norm(right - _product(matrix, keep, x)) / size
    return Iterate(x=x, iterations=done, residual=residual)


def _iterate(
    matrix: bsr_matrix,
    keep: FloatArray,
    x: FloatArray,
    r: FloatArray,
    precondition: Callable[[FloatArray], FloatArray],
    goal: float,
    limit: int,
) -> int:
    """Improve x in place until its recursive residual r reaches the goal; count the steps."""
    z = precondition(r)
    p = z.copy()
    rz = dot(r, z)
    q = np.zeros_like(x)
    for k in range(limit):
        multiply(matrix.indptr, matrix.indices, matrix.data, p, keep, 0.0, q)
        curvature = dot(p, q)
        if not (curvature > 0.0 and rz > 0.0):  # no descent left, or not a number
            return max(k, 1)
        alpha = rz / curvature
        x += alpha * p
        r -= alpha * q
        if norm(r) <= goal:
            return k + 1
        z = precondition(r)
        rz_new = dot(r, z)
        p *= -alpha * dot(z, q) / rz
        p += z
        rz = rz_new
    return limit


def dot(a: FloatArray, b: FloatArray) -> float:
    """Inner product on one thread, whose order of summation never changes."""
    return float(np.einsum("i,i->", a, b))


def norm(a: FloatArray) -> float:
    """Euclidean length, summed as `dot` does."""
    return float(np.sqrt(dot(a, a)))


def _product(matrix: bsr_matrix, keep: FloatArray, x: FloatArray) -> FloatArray:
    """Product with the rows to keep."""
    y = np.zeros_like(x)
    multiply(matrix.indptr, matrix.indices, matrix.data, x, keep, 0.0, y)
    return y
