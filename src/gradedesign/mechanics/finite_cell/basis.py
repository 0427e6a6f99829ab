"""Quadratic shape functions and quadrature of one brick, in its own coordinates from 0 to 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import leggauss

from gradedesign.arrays import FloatArray

#: Gauss points along an edge: of whole elements, and of cut ones, whose weights are fitted. Three
#: are exact for the stiffness of a quadratic brick with straight edges.
WHOLE_POINTS = 3
#: All 125 moments up to degree 4 per axis are fitted at 5 x 5 x 5 points.
CUT_POINTS = 5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """Gauss points of an edge with the three quadratic shape functions there."""

    #: ``(q,)``.
    points: FloatArray
    weights: FloatArray
    #: ``(q, 3)``. Values and derivatives of the functions of the nodes at 0, 1/2 and 1.
    shapes: FloatArray
    slopes: FloatArray


def line(count: int) -> Line:
    """Gauss points of an edge."""
    points, weights = leggauss(count)
    points = (points + 1.0) / 2.0
    shapes, slopes = quadratic(points)
    return Line(points=points, weights=weights / 2.0, shapes=shapes, slopes=slopes)


def quadratic(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and derivatives of the three quadratic functions at t, ``(..., 3)`` each."""
    values = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)
    return values, np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1], axis=-1)


def gauss_weights(count: int) -> FloatArray:
    """Weights of the ``count**3`` points of a brick, x fastest, sum 1."""
    w = line(count).weights
    return np.einsum("k,j,i->kji", w, w, w).ravel()


def lagrange_tables(count: int) -> tuple[FloatArray, FloatArray]:
    """Coefficients, lowest power first, of the Lagrange polynomials of the Gauss points.

    Returns ``values (count, count)``: one polynomial a row; ``integrals (count, count + 1)``: their
    integrals from 0.
    """
    points = line(count).points
    values = np.zeros((count, count))
    integrals = np.zeros((count, count + 1))
    for k, own in enumerate(points):
        others = np.delete(points, k)
        p = Polynomial.fromroots(others)
        p = p / p(own)
        values[k] = p.coef
        integrals[k] = p.integ().coef
    return values, integrals


def shapes_at(places: FloatArray) -> FloatArray:
    """Values of the 27 functions, x fastest, at reference points ``(3, ...)``, ``(..., 27)``."""
    x, y, z = (quadratic(t)[0] for t in places)
    return np.einsum("...k,...j,...i->...kji", z, y, x).reshape(*places.shape[1:], 27)


def gradients_at(places: FloatArray, edges: FloatArray) -> FloatArray:
    """Gradients of the 27 functions at reference points ``(3, ...)`` of a brick, ``(..., 3, 27)``.

    `edges` are the lengths of the brick's edges, ``(3,)``, mm.
    """
    values, slopes = zip(*(quadratic(t) for t in places), strict=True)
    parts = []
    for axis in range(3):
        x, y, z = (slopes[d] if d == axis else values[d] for d in range(3))
        product = np.einsum("...k,...j,...i->...kji", z, y, x) / edges[axis]
        parts.append(product.reshape(*places.shape[1:], 27))
    return np.stack(parts, axis=-2)


def point_stiffness(gradients: FloatArray, moduli: FloatArray) -> FloatArray:
    """Stiffness of points of unit volume, ``(..., 3 n, 3 n)``, from gradients ``(..., 3, n)``.

    ``moduli``, MPa, as `Material.moduli`. Unknowns run x, y, z of the first node, then the second.
    """
    normal, shear = moduli
    n = gradients.shape[-1]
    outer = np.einsum("...ca,...db->...acbd", gradients, gradients)
    matrix = normal[:, None, :] * outer + shear[:, None, :] * np.swapaxes(outer, -3, -1)
    for c in range(3):
        matrix[..., :, c, :, c] += np.einsum("d,...da,...db->...ab", shear[c], gradients, gradients)
    return matrix.reshape(*gradients.shape[:-2], 3 * n, 3 * n)


def gauss_places(count: int) -> FloatArray:
    """Reference coordinates of the ``count**3`` Gauss points, x fastest, ``(3, count**3)``."""
    p = line(count).points
    z, y, x = np.meshgrid(p, p, p, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), z.ravel()])
