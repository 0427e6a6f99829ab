"""The interface of eigenvalue solvers: a symmetric form relative to a stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError

Product: TypeAlias = Callable[[FloatArray], FloatArray]

#: Residual of a value relative to it that is taken; the value's own error is about its square.
#: Chosen, not measured.
MOST_RESIDUAL = 0.02


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EigenProblem:
    """Ends of the spectrum of ``form x = mu K x``.

    Attributes
    ----------
    form : callable
        Product with a symmetric matrix, ``(n,)`` to ``(n,)``, such as a geometric stiffness.
    stiffness : callable
        Product with ``K``.
    solve : callable
        Product with the inverse of ``K``.
    start : (n,) array
    both : bool
        The smallest value is looked for beside the largest.
    negligible : float
        An end smaller than this share of the other need not be resolved.
    """

    form: Product
    stiffness: Product
    solve: Product
    start: FloatArray
    both: bool
    negligible: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtremeValue:
    """One end of the spectrum.

    Attributes
    ----------
    value : float
        Zero where it is negligible beside the other end.
    vector : (n,) array
        Zero with the value.
    """

    value: float
    vector: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class EigenSolver:
    """An eigenvalue solver that ``homogenise --eigen-solver`` can name.

    Attributes
    ----------
    name : str
        Lower case with dashes.
    solve : callable
        `EigenProblem` to the largest value, zero where none is positive, and the smallest, zero
        where none is negative, or None where only the largest is looked for. Raises `SolverError`
        where it does not converge.
    """

    name: str
    solve: Callable[[EigenProblem], tuple[ExtremeValue, ExtremeValue | None]]


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
