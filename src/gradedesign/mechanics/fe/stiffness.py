"""Stiffness of every element: isotropic, a full matrix, or one that varies inside.

Voigt order is xx, yy, zz, yz, xz, xy with engineering shear. The records hold any symmetric values,
so that the derivative of a stiffness by density is one too; `require_positive` is for solving.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import SolverError
from gradedesign.mechanics.fe._matrix_kernels import least_pivots, skewness, upper_rows
from gradedesign.mechanics.fe.element_points import Where, barycentric
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.material.material import Material

#: Rows and columns of the upper triangle of a 6 by 6 matrix, in the order kernels read them.
UPPER = np.triu_indices(6)
#: Pairs of barycentric coordinates, in the order of the moments of a stiffness.
PAIRS = tuple(combinations_with_replacement(range(4), 2))
_FIRST, _SECOND = np.array(PAIRS).T
#: How often each pair stands in the square of the sum of the coordinates, which is 1.
_TIMES = np.where(_FIRST == _SECOND, 1.0, 2.0)
#: Moments of 1: means of the products of two barycentric coordinates over a tetrahedron.
UNIFORM = np.where(_FIRST == _SECOND, 0.1, 0.05)
#: Moments of what is 1 at one Gauss point and 0 at the others, ``(10, 4)``.
GAUSS_MOMENTS = 0.25 * np.prod(barycentric("gauss").T[np.transpose(PAIRS)], axis=0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IsotropicStiffness:
    """One Young's modulus per element and one Poisson ratio.

    Attributes
    ----------
    E : (m,) array, MPa
    nu : float
        Between -1 and 0.5, exclusive.
    """

    E: FloatArray
    nu: float

    def __post_init__(self) -> None:
        lock(self, E=(None,))
        if not -1.0 < self.nu < 0.5:
            raise ValueError(f"Poisson's ratio is {self.nu:g}, expected more than -1, below 0.5")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnisotropicStiffness:
    """One full stiffness matrix per element.

    Attributes
    ----------
    C : (6, 6, m) array, MPa
        Symmetric in its first two axes.
    """

    C: FloatArray

    def __post_init__(self) -> None:
        lock(self, C=(6, 6, None))
        _require_symmetric(self.C)


def dense_stiffness(
    space: TetSpace, material: Material
) -> IsotropicStiffness | AnisotropicStiffness:
    """The base material in every tetrahedron."""
    if material.build is not None:
        return AnisotropicStiffness(
            C=np.repeat(material.stiffness[:, :, None], space.element_count, axis=2)
        )
    return IsotropicStiffness(
        E=np.full(space.element_count, material.youngs_modulus), nu=material.poissons_ratio
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GaussStiffness:
    """One full stiffness matrix at each of the four Gauss points of every element."""

    #: ``(6, 6, 4, m)``, MPa. Symmetric in its first two axes; points as in
    #: `gradedesign.mechanics.fe.element_points`.
    C: FloatArray

    def __post_init__(self) -> None:
        lock(self, C=(6, 6, 4, None))
        _require_symmetric(self.C)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MomentStiffness:
    """Moments of a stiffness that varies inside the elements in any way.

    Strain is linear in a straight-sided quadratic tetrahedron, so that energy depends on the
    stiffness by its means with the products of two barycentric coordinates only.
    """

    #: ``(6, 6, 10, m)``, MPa. Means over the element of the stiffness times the coordinates of each
    #: of `PAIRS`. Each is symmetric, and positive definite where the stiffness is.
    C: FloatArray

    def __post_init__(self) -> None:
        lock(self, C=(6, 6, len(PAIRS), None))
        _require_symmetric(self.C)


Stiffness: TypeAlias = IsotropicStiffness | AnisotropicStiffness | GaussStiffness | MomentStiffness


def _require_symmetric(C: FloatArray) -> None:
    """Raise `ValueError` unless matrices ``(6, 6, ...)`` are symmetric."""
    skew, size = np.zeros((2, C.shape[-1]))
    in_ranges(skewness, range(C.shape[-1]), _by_point(C), skew, size)
    worst, most = skew.max(initial=0.0), size.max(initial=0.0)
    if worst > 1e-9 * most:
        raise ValueError(
            f"C is not symmetric: entries differ by up to {worst:.3g} MPa from their "
            f"transpose, where the largest is {most:.3g} MPa"
        )


def _by_point(C: FloatArray) -> FloatArray:
    """Matrices of elements ``(6, 6, m)``, or those at points or of moments, as ``(6, 6, p, m)``."""
    return C[:, :, None] if C.ndim == 3 else C


def element_count(stiffness: Stiffness) -> int:
    """Number of elements a stiffness describes."""
    if isinstance(stiffness, IsotropicStiffness):
        return stiffness.E.size
    return stiffness.C.shape[-1]


def pair_products(points: FloatArray, weights: FloatArray) -> FloatArray:
    """Matrix that turns values at the points of a quadrature rule into moments.

    ``points (q, 4)``: barycentric coordinates. ``weights (q,)``: with sum 1. Returns ``(10, q)``.
    """
    return np.asarray(weights * points.T[_FIRST] * points.T[_SECOND])


def mean_of(moments: FloatArray) -> FloatArray:
    """Element means ``(..., m)`` of a quantity given by its moments ``(..., 10, m)``."""
    return np.asarray(_TIMES @ moments)


def gauss_moments(values: FloatArray) -> FloatArray:
    """Moments ``(6, 6, 10, m)`` of matrices at the Gauss points of every element."""
    return np.einsum("pq,ijqm->ijpm", GAUSS_MOMENTS, values)


def mean_stiffness(stiffness: Stiffness) -> IsotropicStiffness | AnisotropicStiffness:
    """Stiffness that is even in every element, its mean: all that linear tetrahedra feel of it."""
    if isinstance(stiffness, GaussStiffness):
        return AnisotropicStiffness(C=stiffness.C.mean(axis=2))
    if isinstance(stiffness, MomentStiffness):
        return AnisotropicStiffness(C=mean_of(stiffness.C))
    return stiffness


def gauss_equivalent(stiffness: MomentStiffness) -> GaussStiffness:
    """Stiffness at Gauss points that has the same first moments as the given stiffness.

    Thermal forces of an even temperature change and the mean stress of every element are the same
    with both, since strain is linear; values at the points are not those of the stiffness.
    """
    firsts = np.array([[float(s in pair) for pair in PAIRS] for s in range(4)])
    points = np.linalg.inv(0.25 * barycentric("gauss").T) @ firsts
    return GaussStiffness(C=np.einsum("qp,ijpm->ijqm", points, stiffness.C))


def kernel_coefficients(
    stiffness: IsotropicStiffness | AnisotropicStiffness | GaussStiffness,
) -> FloatArray:
    """Coefficients of each element and point as the kernels read them, MPa.

    Returns ``(m, 1 or 4, 2 or 21)``: Lamé constants lambda and mu, or upper triangle of C by rows;
    one point where the stiffness is constant in the elements.
    """
    if isinstance(stiffness, IsotropicStiffness):
        e, nu = stiffness.E, stiffness.nu
        lame = np.stack([e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))], axis=1)
        return lame[:, None]
    return _upper_rows(_by_point(stiffness.C))


def _upper_rows(C: FloatArray) -> FloatArray:
    """Upper triangles ``(m, p, 21)`` of matrices ``(6, 6, p, m)``."""
    rows = np.zeros((C.shape[3], C.shape[2], len(UPPER[0])))
    in_ranges(upper_rows, range(len(rows)), C, rows)
    return rows


def moment_coefficients(stiffness: GaussStiffness | MomentStiffness) -> FloatArray:
    """Upper triangles ``(m, 10, 21)`` of the moments of a stiffness, MPa."""
    if isinstance(stiffness, GaussStiffness):
        return np.ascontiguousarray(np.einsum("pq,cqm->mpc", GAUSS_MOMENTS, stiffness.C[UPPER]))
    return _upper_rows(stiffness.C)


def known_at(
    stiffness: Stiffness, at: Where
) -> IsotropicStiffness | AnisotropicStiffness | GaussStiffness:
    """Return the stiffness if it has values at the points ``at``; raise otherwise.

    Raises `SolverError` for a `MomentStiffness`, and for a `GaussStiffness` at vertices.
    """
    if isinstance(stiffness, MomentStiffness):
        raise SolverError(
            "stress and thermal forces need the stiffness at points of the elements, but only its "
            "moments are given; take an AnisotropicStiffness of its means"
        )
    if isinstance(stiffness, GaussStiffness) and at != "gauss":
        raise SolverError(
            f"the stiffness is given at the Gauss points, but asked for at {at}; evaluate at "
            "'gauss'"
        )
    return stiffness


def require_positive(stiffness: Stiffness) -> None:
    """Raise unless the stiffness of every element (every moment of it) is positive definite.

    Raises `SolverError` if a modulus is not positive or a matrix not positive definite. Moments are
    positive definite where the stiffness is; the reverse holds for their means only.
    """
    if isinstance(stiffness, IsotropicStiffness):
        bad = np.flatnonzero(~(stiffness.E > 0.0))
        if bad.size:
            raise SolverError(
                f"Young's modulus of {bad.size} elements is not positive; element {bad[0]} has "
                f"{stiffness.E[bad[0]]:.4g} MPa. Raise the lower density bound"
            )
        return
    pivots = np.zeros(element_count(stiffness))
    in_ranges(least_pivots, range(pivots.size), _upper_rows(_by_point(stiffness.C)), pivots)
    bad = np.flatnonzero(~(pivots > 0.0))
    if bad.size:
        first = np.moveaxis(_by_point(stiffness.C)[..., bad[0]], 2, 0)
        lowest = np.linalg.eigvalsh(first).min() if np.isfinite(first).all() else np.nan
        raise SolverError(
            f"the stiffness matrix of {bad.size} elements is not positive definite; the lowest "
            f"eigenvalue of element {bad[0]} is {lowest:.4g} MPa. Raise the lower density bound or "
            f"correct the scaling law"
        )
