"""The eigenvalue solver ``scipy``: ARPACK's restarted Lanczos iteration, as a reference."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign import (
    EigenProblem,
    EigenSolver,
    ExtremeValue,
    SolverError,
)
from gradedesign.fields import FloatArray

Product = Callable[[FloatArray], FloatArray]

#: Residual of a value relative to it, as `lanczos` asks for.
_RTOL = 3e-3
#: Restarts, of about 20 solves each. Chosen, not measured.
_MOST_RESTARTS = 12


def _scipy_extremes(problem: EigenProblem) -> tuple[ExtremeValue, ExtremeValue | None]:
    """Largest and, on request, smallest ``mu`` of ``form x = mu K x`` by ``eigsh``.

    Raises
    ------
    SolverError
        If the restarts do not suffice, as where one end is very near zero.
    """
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    n = problem.start.size

    def operator(product: Product) -> LinearOperator:
        return LinearOperator((n, n), matvec=product, dtype=np.float64)

    start = problem.solve(problem.form(problem.start))
    nothing = ExtremeValue(value=0.0, vector=np.zeros(n))
    if not start.any():
        return nothing, nothing if problem.both else None
    try:
        values, vectors = eigsh(
            operator(problem.form),
            k=1 + problem.both,
            which="BE" if problem.both else "LA",
            M=operator(problem.stiffness),
            Minv=operator(problem.solve),
            v0=start,
            tol=_RTOL,
            maxiter=_MOST_RESTARTS,
        )
    except ArpackError as error:
        raise SolverError(
            f"the lowest buckling load was not found by scipy's eigsh ({error}); take "
            f"the eigenvalue solver lanczos or another macroscopic stress"
        ) from error
    largest = float(np.abs(values).max())

    def end(k: int, sign: int) -> ExtremeValue:
        value, vector = float(values[k]), np.asarray(vectors[:, k])
        if sign * value <= problem.negligible * largest:
            return nothing
        return ExtremeValue(value=value, vector=vector)

    high = end(int(np.argmax(values)), 1)
    return high, end(int(np.argmin(values)), -1) if problem.both else None


SCIPY = EigenSolver(name="scipy", solve=_scipy_extremes)
