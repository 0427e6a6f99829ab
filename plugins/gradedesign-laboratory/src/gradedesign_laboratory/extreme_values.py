"""Ends of a spectrum by any eigenvalue solver, held to their residuals."""

from __future__ import annotations

import numpy as np

from gradedesign import EigenProblem, EigenSolver, ExtremeValue, SolverError

#: Residual of a value relative to it that is taken; the value's own error is about its square.
#: Chosen, not measured.
MOST_RESIDUAL = 0.02


def extreme_values(
    solver: EigenSolver, problem: EigenProblem
) -> tuple[ExtremeValue, ExtremeValue | None]:
    """Ends of a spectrum by a solver, each held to its residual, which costs one solve.

    Returns
    -------
    tuple of ExtremeValue
        Largest, and smallest or None.

    Raises
    ------
    SolverError
        If the solver does not converge, or returns a value that is no extreme one of this problem.
    """
    ends = solver.solve(problem)
    expected = [ExtremeValue, ExtremeValue if problem.both else type(None)]
    if not isinstance(ends, tuple) or [type(end) for end in ends] != expected:
        raise SolverError(
            f"eigenvalue solver '{solver.name}' returned {ends!r:.80}, expected the largest "
            f"ExtremeValue and the smallest{'' if problem.both else ', here None'}"
        )
    for end, sign in zip(ends, (1, -1), strict=True):
        if end is not None and end.value != 0:
            _require_end(solver.name, problem, end, sign)
    return ends


def _require_end(name: str, problem: EigenProblem, end: ExtremeValue, sign: int) -> None:
    """Refuse a value of the wrong sign or whose residual is too large."""
    x, value = end.vector, end.value
    if np.shape(x) != problem.start.shape or not np.isfinite([value, np.sum(x)]).all():
        raise SolverError(
            f"eigenvalue solver '{name}' returned a vector of shape {np.shape(x)} to {value:.4g}, "
            f"expected {problem.start.shape} finite numbers"
        )
    product = problem.stiffness(x)
    rest = problem.form(x) - value * product
    size = abs(value) * max(float(x @ product), 0.0) ** 0.5
    residual = max(float(rest @ problem.solve(rest)), 0.0) ** 0.5
    if sign * value < 0 or not residual <= MOST_RESIDUAL * size:
        raise SolverError(
            f"eigenvalue solver '{name}' returned {value:.4g} as the "
            f"{'largest' if sign > 0 else 'smallest'} value, whose residual is {residual:.2g} of "
            f"{size:.2g}; expected a value {'above' if sign > 0 else 'below'} 0 and a residual of "
            f"at most {MOST_RESIDUAL:g} times that; take 'lanczos'"
        )
