"""Stiffness of every element: isotropic, a full matrix, or one at every point of a rule.

Voigt order is xx, yy, zz, yz, xz, xy with engineering shear. The records hold any symmetric values,
so that the derivative of a stiffness by density is one too; `require_positive` is for solving.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import SolverError
from gradedesign.material.scaling_law import isotropic_stiffness

#: Rows and columns of the upper triangle of a 6 by 6 matrix, in the order kernels read them.
UPPER = np.triu_indices(6)


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
        object.__setattr__(self, "E", locked(self.E, (None,), name="E"))
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
        object.__setattr__(self, "C", locked(self.C, (6, 6, None), name="C"))
        require_symmetric(self.C)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointStiffness:
    """One full stiffness matrix at every point of an integration rule, element by element.

    Attributes
    ----------
    C : (6, 6, q, m) array, MPa
        Symmetric in its first two axes.
    points : (q, 4) array
        Barycentric coordinates of the rule.
    weights : (q,) array
        Positive, with sum 1.
    """

    C: FloatArray
    points: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", locked(self.weights, (None,), name="weights"))
        count = self.weights.size
        object.__setattr__(self, "points", locked(self.points, (count, 4), name="points"))
        object.__setattr__(self, "C", locked(self.C, (6, 6, count, None), name="C"))
        require_symmetric(self.C)
        if not (self.weights > 0).all() or abs(self.weights.sum() - 1) > 1e-9:
            raise ValueError("weights of the rule must be positive with sum 1")


Stiffness: TypeAlias = IsotropicStiffness | AnisotropicStiffness | PointStiffness


def require_symmetric(C: FloatArray) -> None:
    """Raise `ValueError` unless matrices ``(6, 6, ...)`` are symmetric."""
    skew = np.abs(C - C.swapaxes(0, 1)).max(initial=0.0)
    size = np.abs(C).max(initial=0.0)
    if skew > 1e-9 * size:
        raise ValueError(
            f"C is not symmetric: entries differ by up to {skew:.3g} MPa from their "
            f"transpose, where the largest is {size:.3g} MPa"
        )


def element_count(stiffness: Stiffness) -> int:
    """Number of elements a stiffness describes."""
    if isinstance(stiffness, IsotropicStiffness):
        return stiffness.E.size
    return stiffness.C.shape[-1]


def stiffness_matrices(stiffness: Stiffness) -> FloatArray:
    """Full matrices ``(6, 6, m)``, MPa; of one that varies in the elements, their means."""
    if isinstance(stiffness, IsotropicStiffness):
        return isotropic_stiffness(stiffness.E, stiffness.nu)
    if isinstance(stiffness, PointStiffness):
        return np.asarray(np.tensordot(stiffness.C, stiffness.weights, axes=(2, 0)))
    return stiffness.C


def kernel_coefficients(stiffness: IsotropicStiffness | AnisotropicStiffness) -> FloatArray:
    """Coefficients per element as the kernels read them, MPa.

    Returns
    -------
    array
        ``(m, 2)`` Lamé constants lambda and mu, or ``(m, 21)`` upper triangle of C by rows.
    """
    if isinstance(stiffness, IsotropicStiffness):
        e, nu = stiffness.E, stiffness.nu
        return np.stack([e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))], axis=1)
    return np.ascontiguousarray(stiffness.C[UPPER].T)


def point_coefficients(stiffness: PointStiffness) -> FloatArray:
    """Upper triangles ``(m, q, 21)`` of the matrices at the points, MPa."""
    return np.ascontiguousarray(stiffness.C[UPPER].transpose(2, 1, 0))


def constant_in_elements(stiffness: Stiffness) -> IsotropicStiffness | AnisotropicStiffness:
    """The stiffness, refused where it varies inside elements.

    Raises
    ------
    SolverError
        For a `PointStiffness`: what is asked for is evaluated at other points than its own.
    """
    if isinstance(stiffness, PointStiffness):
        raise SolverError(
            "stress and thermal forces need one stiffness for each element, but it is given at "
            f"{stiffness.weights.size} points of each; take stiffness_matrices of it, or that of "
            "one phase"
        )
    return stiffness


def require_positive(stiffness: Stiffness) -> None:
    """Raise unless every element is stable.

    Raises
    ------
    SolverError
        If a modulus is not positive or a matrix not positive definite.
    """
    if isinstance(stiffness, IsotropicStiffness):
        bad = np.flatnonzero(~(stiffness.E > 0.0))
        if bad.size:
            raise SolverError(
                f"Young's modulus of {bad.size} elements is not positive; element {bad[0]} has "
                f"{stiffness.E[bad[0]]:.4g} MPa. Raise the lower density bound"
            )
        return
    lowest = _lowest_eigenvalues(stiffness.C)
    if isinstance(stiffness, PointStiffness):
        lowest = lowest.reshape(stiffness.C.shape[2:]).min(axis=0)
    bad = np.flatnonzero(~(lowest > 0.0))
    if bad.size:
        raise SolverError(
            f"the stiffness matrix of {bad.size} elements is not positive definite; the lowest "
            f"eigenvalue of element {bad[0]} is {lowest[bad[0]]:.4g} MPa. Raise the lower "
            f"density bound or correct the scaling law"
        )


def _lowest_eigenvalues(C: FloatArray) -> FloatArray:
    """Lowest eigenvalue of every matrix, only computed where Cholesky's method fails."""
    matrices = np.moveaxis(C.reshape(6, 6, -1), 2, 0)
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return np.linalg.eigvalsh(matrices)[:, 0].astype(np.float64)
    return np.ones(len(matrices))
