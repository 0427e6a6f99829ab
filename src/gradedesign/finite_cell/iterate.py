"""Conjugate gradients in double precision around a preconditioner in single precision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.finite_cell.operator import Operator, apply
from gradedesign.workspace.progress import report_step


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Iterate:
    """Where an iteration ended.

    Attributes
    ----------
    u : (N, 3) array, mm
    iterations : int
    residual : float
        True residual over the right-hand side.
    """

    u: FloatArray
    iterations: int
    residual: float


def conjugate_gradients(
    stiffness: Operator,
    keep: FloatArray,
    right: FloatArray,
    precondition: Callable[[FloatArray], FloatArray],
    *,
    rtol: float,
    max_iterations: int,
    start: FloatArray | None = None,
) -> Iterate:
    """Solve ``K u = right`` over the unknowns to keep; the others stay zero.

    The new direction uses the change of the residual (Polak and Ribière), which tolerates a
    preconditioner that is symmetric to single precision only.

    Parameters
    ----------
    stiffness : Operator
        In double precision.
    keep, right : (N, 3) array
    precondition : callable
        Residual to correction.
    rtol : float
        Residual at which to stop, over the right-hand side.
    max_iterations : int
    start : (N, 3) array, optional

    Returns
    -------
    Iterate
        Converged or not: the caller judges the residual.
    """
    u = np.zeros_like(right) if start is None else start * keep
    size = _norm(right)
    q = np.zeros_like(u)
    apply(stiffness, u, q)
    r = keep * (right - q)
    first = now = _norm(r)
    done = 0
    if size > 0.0 and now > rtol * size:
        z = precondition(r)
        p = z.copy()
        rz = _dot(r, z)
        while True:
            apply(stiffness, p, q)
            q *= keep
            done += 1
            curvature = _dot(p, q)
            if not (curvature > 0.0 and rz > 0.0):
                break
            alpha = rz / curvature
            u += alpha * p
            r -= alpha * q
            now = _norm(r)
            if now <= rtol * size or done >= max_iterations:
                break
            won = np.log(first / now) / np.log(first / (rtol * size)) if now > 0 else 1.0
            report_step("multigrid", float(np.clip(won, 0.0, 1.0)))
            z = precondition(r)
            p *= -_dot(z, q) / curvature
            p += z
            rz = _dot(r, z)
    apply(stiffness, u, q)
    left = _norm(keep * (right - q))
    return Iterate(u=u, iterations=done, residual=left / size if size > 0.0 else 0.0)


def _dot(a: FloatArray, b: FloatArray) -> float:
    """Inner product on one thread, whose order of summation never changes."""
    return float(np.einsum("i,i->", a.ravel(), b.ravel()))


def _norm(a: FloatArray) -> float:
    """Euclidean norm, likewise."""
    return float(np.sqrt(_dot(a, a)))
