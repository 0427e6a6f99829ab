"""Chebyshev's iteration in single precision, which smooths one level of multigrid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.solver._multigrid_kernels import relax
from gradedesign.mechanics.solver.block_rows import (
    BlockRows,
    SingleArray,
    inverted_diagonal,
    largest_eigenvalue,
    product,
    single_precision,
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Smoother:
    """Chebyshev's iteration for one matrix."""

    matrix: BlockRows
    keep: SingleArray  #: ``(n,)`` float32. 0 on fixed unknowns, 1 elsewhere.
    inverse: SingleArray  #: ``(n / b, b, b)`` float32. Inverted diagonal blocks, zero where fixed.
    #: Safe estimate of the largest eigenvalue of the inverted diagonal times the matrix.
    largest: float
    steps: int
    span: float  #: Eigenvalues from `largest` down to `largest` / `span` are damped.


def smooth(
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


def build_smoother(matrix: bsr_matrix, keep: FloatArray, smoothing: tuple[int, float]) -> Smoother:
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
