"""Conjugate gradients in double precision around a preconditioner in single precision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.finite_cell.operator import Operator, apply

#: Fewest steps over which the gain in energy estimates the error. Chosen, not measured.
_LEAST_DELAY = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Iterate:
    """Last state of an iteration."""

    u: FloatArray  #: ``(N, 3)``, mm.
    iterations: int
    residual: float  #: True residual over the right-hand side.
    #: Estimated error in the energy norm over that of the solution; 0 where the iteration ended by
    #: its residual before there was an estimate.
    error: float


def conjugate_gradients(
    stiffness: Operator,
    keep: NDArray[np.float32],
    right: FloatArray,
    precondition: Callable[[FloatArray, FloatArray], None],
    *,
    rtol: float,
    energy: float,
    max_iterations: int,
    start: FloatArray | None = None,
) -> Iterate:
    """Solve ``K u = right`` over the unknowns to keep; the others stay zero.

    The new direction uses the change of the residual (Polak and Ribière), which tolerates a
    preconditioner that is symmetric to single precision only.

    The iteration ends by its residual or by its error in the energy norm, whichever is small first.
    Of the square of that error, every step takes away a known share: the shares of the last third
    of the steps estimate what was left before them (Strakoš and Tichý, ETNA 13, 2002, p. 56). The
    delay grows with the iterations, since parts that hang by slivers converge late (Meurant, Papež
    and Tichý, Numer. Algorithms 88, 2021, p. 1337, choose it by other means). Returns Iterate:
    converged or not: the caller judges the residual.

    - ``stiffness``: in double precision
    - ``keep (N, 3)``: 1 for unknowns, 0 for the others
    - ``right (N, 3)``: zero where nothing is kept
    - ``precondition``: sets its second argument to the correction for a residual
    - ``rtol``: residual at which to stop, over the right-hand side
    - ``energy``: error at which to stop, in the energy norm over that of the solution; 0 for the
      residual alone
    - ``start (N, 3)``
    """
    u = np.zeros_like(right) if start is None else start * keep
    size = _norm(right)
    q = np.zeros_like(u)
    apply(stiffness, u, q)
    r = right - q
    r *= keep
    first = now = _norm(r)
    done, error = 0, 0.0
    gains: list[float] = []
    if size > 0.0 and now > rtol * size:
        z = np.zeros_like(r)
        precondition(r, z)
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
            # The last correction is used up: its place takes the steps.
            u += np.multiply(p, alpha, out=z)
            r -= np.multiply(q, alpha, out=z)
            now = _norm(r)
            gains.append(alpha * rz)
            error = _delayed_error(gains, _dot(right, u))
            if now <= rtol * size or 0.0 < error <= energy or done >= max_iterations:
                break
            won = np.log(first / now) / np.log(first / (rtol * size)) if now > 0 else 1.0
            if energy and error:
                won = max(won, 1.0 - np.log(error / energy) / np.log(1.0 / energy))
            report_step("multigrid", float(np.clip(won, 0.0, 1.0)))
            precondition(r, z)
            p *= -_dot(z, q) / curvature
            p += z
            rz = _dot(r, z)
    apply(stiffness, u, q)
    np.subtract(right, q, out=q)
    q *= keep
    left = _norm(q)
    return Iterate(u=u, iterations=done, residual=left / size if size > 0.0 else 0.0, error=error)


def _delayed_error(gains: list[float], energy: float) -> float:
    """Error in the energy norm, over the root of the energy, before the last third of the steps.

    Zero while there are too few steps for an estimate.
    """
    delay = max(_LEAST_DELAY, len(gains) // 3)
    if len(gains) <= delay or energy <= 0.0:
        return 0.0
    return float(np.sqrt(sum(gains[-delay:]) / energy))


def _dot(a: FloatArray, b: FloatArray) -> float:
    """Inner product on one thread, whose order of summation never changes."""
    return float(np.einsum("i,i->", a.ravel(), b.ravel()))


def _norm(a: FloatArray) -> float:
    """Euclidean norm, likewise."""
    return float(np.sqrt(_dot(a, a)))
