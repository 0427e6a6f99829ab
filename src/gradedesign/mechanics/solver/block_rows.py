"""Block-sparse matrices in single precision, their inverted diagonals and eigenvalue bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.solver._multigrid_kernels import inverse_diagonal, multiply, relax

SingleArray = NDArray[np.float32]

#: Steps and safety factor of the estimate of the largest eigenvalue. Chosen, not measured.
_LANCZOS_STEPS = 15
#: Lanczos estimates approach the eigenvalue from below, and Chebyshev's iteration diverges above
#: its interval. Chosen, not measured.
_EIGENVALUE_MARGIN = 1.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockRows:
    """A matrix of dense blocks in compressed rows, in single precision."""

    row: NDArray[np.int32]
    column: NDArray[np.int32]
    blocks: SingleArray  #: ``(n_blocks, r, c)`` float32.


def product(
    matrix: BlockRows, x: SingleArray, keep: SingleArray, add: float, y: SingleArray
) -> None:
    """``y = add y + keep (A x)``."""
    multiply(matrix.row, matrix.column, matrix.blocks, x, keep, add, y)


def single_precision(matrix: bsr_matrix) -> BlockRows:
    """Copy a block matrix to single precision."""
    return BlockRows(
        row=matrix.indptr.astype(np.int32),
        column=matrix.indices.astype(np.int32),
        blocks=np.ascontiguousarray(matrix.data, dtype=np.float32),
    )


def inverted_diagonal(matrix: bsr_matrix, keep: FloatArray) -> SingleArray:
    """Inverted diagonal blocks."""
    blocks = np.ascontiguousarray(matrix.data, dtype=np.float64)
    return inverse_diagonal(
        matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), blocks, keep
    )


def largest_eigenvalue(matrix: BlockRows, keep: FloatArray, inverse: SingleArray) -> float:
    """Largest eigenvalue of the inverted diagonal times the matrix, with a margin."""
    mask = keep.astype(np.float32)

    def apply(p: SingleArray) -> SingleArray:
        q = np.zeros_like(p)
        product(matrix, p, mask, 0.0, q)
        return q

    def precondition(r: SingleArray) -> SingleArray:
        zero, d, z = (np.zeros_like(r) for _ in range(3))
        relax(inverse, r, zero, 0.0, 1.0, d, z)
        return z

    return largest_preconditioned(apply, precondition, mask)


def largest_preconditioned(
    apply: Callable[[SingleArray], SingleArray],
    precondition: Callable[[SingleArray], SingleArray],
    mask: SingleArray,
) -> float:
    """Largest eigenvalue of a preconditioner times an operator, with a margin.

    Preconditioned conjugate gradients give Lanczos' tridiagonal matrix (Saad, section 6.7.3),
    whose largest eigenvalue converges far faster than power iteration.

    ``apply``, ``precondition``: arrays of the shape of `mask` to such arrays. ``mask``: float32
    array; 0 on fixed unknowns, 1 elsewhere.
    """
    random = np.random.default_rng(20240229)
    r = random.standard_normal(mask.size).astype(np.float32).reshape(mask.shape) * mask
    p = np.zeros_like(r)
    alphas: list[float] = []
    betas: list[float] = []
    rz = 0.0
    for _ in range(min(_LANCZOS_STEPS, int(np.count_nonzero(mask)))):
        z = precondition(r)
        rz_new = float(np.einsum("i,i->", r.ravel(), z.ravel()))
        if rz_new <= 1e-12 * rz or rz_new <= 0.0:
            break
        if alphas:
            betas.append(rz_new / rz)
            p *= np.float32(betas[-1])
        p += z
        rz = rz_new
        q = apply(p)
        alphas.append(rz / float(np.einsum("i,i->", p.ravel(), q.ravel())))
        r -= np.float32(alphas[-1]) * q
    if not alphas:
        return 1.0
    a, b = np.array(alphas), np.array(betas[: len(alphas) - 1])
    diagonal = 1.0 / a
    diagonal[1:] += b / a[:-1]
    off = np.sqrt(b) / a[:-1]
    lanczos = np.diag(diagonal) + np.diag(off, 1) + np.diag(off, -1)
    return _EIGENVALUE_MARGIN * float(np.linalg.eigvalsh(lanczos)[-1])
