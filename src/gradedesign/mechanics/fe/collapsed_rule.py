"""Integration rules on tetrahedra of any degree: Gauss points of a cube, collapsed."""

from __future__ import annotations

import numpy as np
from scipy.special import roots_jacobi

from gradedesign.arrays import FloatArray


def collapsed_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Rule of ``count**3`` points, exact for polynomials of degree ``2 count - 1``.

    Returns ``points (count**3, 4)``: barycentric coordinates, all inside; ``weights (count**3,)``:
    positive, with sum 1.

    References
    ----------
    A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971: conical products.
    """
    if count < 1:
        raise ValueError(f"a rule of {count} points along an edge; expected 1 or more")
    axes = [roots_jacobi(count, power, 0) for power in (2, 1, 0)]
    (a, b, c), (u, v, w) = zip(*[(0.5 * (x + 1), y / y.sum()) for x, y in axes], strict=True)
    first, second, third = np.meshgrid(a, b, c, indexing="ij")
    x = first
    y = second * (1 - first)
    z = third * (1 - first) * (1 - second)
    points = np.stack([1 - x - y - z, x, y, z], axis=-1).reshape(-1, 4)
    return points, np.einsum("i,j,k->ijk", u, v, w).ravel()
