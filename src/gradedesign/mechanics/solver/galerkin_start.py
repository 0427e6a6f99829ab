"""First guesses of linear solves: the best combination of solutions of similar problems."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import bsr_matrix

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.mechanics.solver._multigrid_kernels import multiply

#: Share of the largest singular value below which directions of the combination are dropped: the
#: Gram matrix of unit vectors holds no more digits.
DEPENDENT = 1e-13


def galerkin_start(
    matrix: bsr_matrix, free: BoolArray, right: FloatArray, earlier: Sequence[FloatArray]
) -> FloatArray:
    """Combine fields into first guesses that are nearest to the solutions in energy.

    Galerkin's method on the span of the fields: no combination of them leaves an error of less
    energy. Where a design changes little from step to step, two steps' solutions leave a residual
    of the square of the change (P. F. Fischer, Comput. Methods Appl. Mech. Eng. 163, 1998, p. 193).
    Returns ``(k, n)``: zero where not free.

    - ``matrix``: (n, n) bsr_matrix; without supports
    - ``free (n,)``: unknowns to solve for
    - ``right (k, n)``: right-hand sides, zero where not free
    - ``earlier``, each ``(3, n / 3)``: such as the displacements of the designs before. None at all
      starts from zero.
    """
    basis = _unit_vectors(free, earlier)
    if not len(basis):
        return np.zeros_like(right)
    image = np.zeros_like(basis)
    keep = free.astype(np.float64)
    multiply(matrix.indptr, matrix.indices, matrix.data, basis, keep, 0.0, image)
    weights = np.linalg.lstsq(basis @ image.T, basis @ right.T, rcond=DEPENDENT)[0]
    return np.asarray(weights.T @ basis)


def _unit_vectors(free: BoolArray, earlier: Sequence[FloatArray]) -> FloatArray:
    """Interleaved fields ``(m, n)`` of length 1, zero where not free, without vanishing ones."""
    fields = [free * np.ascontiguousarray(u.T).ravel() for u in earlier]
    lengths = [float(np.linalg.norm(v)) for v in fields]
    kept = [v / s for v, s in zip(fields, lengths, strict=True) if s > 0.0]
    return np.array(kept) if kept else np.zeros((0, free.size))
