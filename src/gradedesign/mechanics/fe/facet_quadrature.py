"""Quadrature on the facets of a surface, by which tractions act on it."""

from __future__ import annotations

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from gradedesign.arrays import FloatArray

#: Degree up to which a traction function times a shape function is integrated exactly. Chosen, not
#: measured.
_TRACTION_DEGREE = 6


def reference_rule() -> tuple[FloatArray, FloatArray]:
    """Points ``(2, q)`` and weights ``(q,)``, sum 1/2, in the reference triangle."""
    points, weights = get_quadrature(RefTri, _TRACTION_DEGREE)
    return np.asarray(points), np.asarray(weights)


def facet_points(corners: FloatArray) -> FloatArray:
    """Points of quadrature of facets ``(3, 3 corners, k)``, at which tractions are asked for.

    Returns ``(3, k, q)``, mm: of weights `facet_weights`.
    """
    reference, _ = reference_rule()
    return np.einsum("dak,aq->dkq", corners, facet_shapes(1, reference))


def facet_weights(area: FloatArray) -> FloatArray:
    """Weights of `facet_points` on facets of areas ``(k,)``, ``(k, q)``, mm^2."""
    _, weights = reference_rule()
    return np.outer(area, 2.0 * weights)


def facet_shapes(order: int, points: FloatArray) -> FloatArray:
    """Shape functions of the 3- or 6-node triangle at reference points ``(2, q)``."""
    a, b, c = 1.0 - points[0] - points[1], points[0], points[1]
    if order == 1:
        return np.array([a, b, c])
    return np.array(
        [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a]
    )
