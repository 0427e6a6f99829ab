"""First guess of the iteration: the displacements of other load cases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.finite_cell.operator import Operator, product

#: Share of the largest singular value below which directions of a combination are dropped. Chosen,
#: not measured.
DEPENDENT = 1e-10


def nearest_combination(
    stiffness: Operator,
    keep: NDArray[np.float32],
    right: FloatArray,
    fields: Sequence[FloatArray],
) -> FloatArray | None:
    """Combination of fields that is nearest to the solution of ``K u = right`` in energy.

    Galerkin's method on their span, as `gradedesign.mechanics.solver.galerkin_start` does on
    tetrahedra: a load at an angle between two others is solved by their sum. Returns ``(N, 3)``:
    None without fields.

    ``keep (N, 3)``: 1 for unknowns, 0 for the others. ``right (N, 3)``: zero where nothing is kept.
    ``fields``, each ``(N, 3)``: zero where nothing is kept.
    """
    if not fields:
        return None
    sizes = [max(float(np.linalg.norm(field)), 1e-300) for field in fields]
    pairs = list(zip(fields, sizes, strict=True))
    gram = np.zeros((len(fields), len(fields)))
    for k, field in enumerate(fields):
        image = product(stiffness, field)
        image *= keep
        gram[k] = [np.einsum("nc,nc->", image, v) / s / sizes[k] for v, s in pairs]
    work = [np.einsum("nc,nc->", right, v) / s for v, s in pairs]
    weights = np.linalg.lstsq(gram, np.array(work), rcond=DEPENDENT)[0] / sizes
    guess = np.zeros_like(right)
    for weight, field in zip(weights, fields, strict=True):
        guess += weight * field
    return guess
