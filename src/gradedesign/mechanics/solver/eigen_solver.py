"""The interface of eigenvalue solvers: a symmetric form relative to a stiffness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from gradedesign.arrays import FloatArray

Product: TypeAlias = Callable[[FloatArray], FloatArray]


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
