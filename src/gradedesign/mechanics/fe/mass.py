"""Consistent mass of tetrahedra: products and works of inertia, without a matrix.

Integrals are exact: with straight sides products of shape functions are polynomials.
"""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.fe._space_kernels import LOCAL_EDGES
from gradedesign.mechanics.fe.space import TetSpace


@cache
def shape_products(order: int) -> FloatArray:
    """Means over a tetrahedron of products of two shape functions, ``(4, 4)`` or ``(10, 10)``.

    Every shape function is a polynomial in barycentric coordinates; the mean of
    ``l0^a l1^b l2^c l3^d`` is ``3! a! b! c! d! / (3 + a + b + c + d)!`` (Zienkiewicz and Taylor,
    The Finite Element Method, 5th ed., vol. 1, eq. 8.38).
    """
    monomials = np.zeros((4 if order == 1 else 10, *(4,) * order))
    for i in range(4):
        if order == 1:
            monomials[i, i] = 1.0
        else:  # l (2 l - 1), where 1 is the sum of all coordinates
            monomials[i, i] -= 1.0
            monomials[i, i, i] += 2.0
    for k, (i, j) in enumerate(LOCAL_EDGES if order == 2 else ()):
        monomials[4 + k, i, j] = 4.0
    flat = monomials.reshape(len(monomials), -1)
    powers = [np.bincount(at, minlength=4) for at in np.ndindex(*(4,) * order)]
    means = np.array([[_mean(p + q) for q in powers] for p in powers])
    return np.asarray(flat @ means @ flat.T)


def _mean(powers: np.ndarray) -> float:
    """Mean of a product of powers of barycentric coordinates."""
    top = 6.0 * np.prod([factorial(int(p)) for p in powers])
    return float(top / factorial(3 + int(powers.sum())))


def mass_product(space: TetSpace, masses: FloatArray, x: FloatArray) -> FloatArray:
    """Product of the mass matrix with degrees of freedom, ``(3 N,)``.

    ``masses (M,)``, t: of every tetrahedron, spread evenly in it. ``x (3 N,)``:
    ``3 * node + component``.
    """
    means, field = shape_products(space.order), x.reshape(-1, 3).T
    out = np.zeros((3, space.node_count))
    nodes = space.elements.ravel()
    for c in range(3):
        own = means @ (field[c][space.elements] * masses)
        out[c] = np.bincount(nodes, weights=own.ravel(), minlength=space.node_count)
    return np.ascontiguousarray(out.T).ravel()


def squares_per_element(space: TetSpace, u: FloatArray) -> FloatArray:
    """Mean of the squared displacement ``(3, N)`` in every tetrahedron, ``(M,)``, mm^2."""
    means = shape_products(space.order)
    total = np.zeros(space.element_count)
    for own in u:
        at = own[space.elements]
        total += np.einsum("am,am->m", at, means @ at)
    return total
