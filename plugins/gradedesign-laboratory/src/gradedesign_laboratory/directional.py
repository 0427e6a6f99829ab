"""Young's modulus, shear modulus and Poisson's ratio in every direction, and their extremes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from gradedesign.fields import FloatArray
from gradedesign.properties import youngs_along

_VOIGT = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
#: Directions from which the extremes are refined. Chosen, not measured.
_STARTS = 2000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TransverseRange:
    """Shear modulus and Poisson's ratio about directions, over all directions across them.

    Attributes
    ----------
    shear_least, shear_mean, shear_greatest : (...) array
        Of the modulus for shear between the direction and one across it, in the stiffness' unit.
    poisson_least, poisson_mean, poisson_greatest : (...) array
        Contraction across over extension along, under tension along; below zero: auxetic.
    """

    shear_least: FloatArray
    shear_mean: FloatArray
    shear_greatest: FloatArray
    poisson_least: FloatArray
    poisson_mean: FloatArray
    poisson_greatest: FloatArray


def compliance_tensor(stiffness: FloatArray) -> FloatArray:
    """Compliance ``(3, 3, 3, 3)`` of a stiffness ``(6, 6)`` with engineering shear."""
    s = np.linalg.inv(stiffness)
    half = np.array([1.0, 1.0, 1.0, 0.5, 0.5, 0.5])
    s = s * half[:, None] * half
    return np.asarray(s[_VOIGT[:, :, None, None], _VOIGT[None, None]])


def transverse_range(stiffness: FloatArray, direction: FloatArray) -> TransverseRange:
    """Exact extremes of shear modulus and Poisson's ratio across given directions.

    Parameters
    ----------
    stiffness : (6, 6) array
    direction : (3, ...) array
        Of any length but zero.

    Notes
    -----
    For a direction n, ``1 / G`` and ``nu / E`` are quadratic forms of the direction across, so
    their extremes are the eigenvalues of 2 by 2 matrices, the mean of nu is half a trace, and that
    of G, ``1 / (a cos^2 + b sin^2)`` over the circle, is ``1 / sqrt(a b)``.
    """
    s = compliance_tensor(stiffness)
    n = direction / np.linalg.norm(direction, axis=0)
    frame = _across(n)
    along = np.einsum("ijkl,i...,j...,k...,l...->...", s, n, n, n, n)
    contraction = -np.einsum("ijkl,i...,j...->kl...", s, n, n)
    sliding = 4 * np.einsum("ijkl,i...,k...->jl...", s, n, n)
    poisson = _eigenvalues(np.einsum("ai...,ij...,bj...->ab...", frame, contraction, frame))
    shear = _eigenvalues(np.einsum("ai...,ij...,bj...->ab...", frame, sliding, frame))
    return TransverseRange(
        shear_least=1 / shear[1],
        shear_mean=1 / np.sqrt(shear[0] * shear[1]),
        shear_greatest=1 / shear[0],
        poisson_least=poisson[0] / along,
        poisson_mean=0.5 * (poisson[0] + poisson[1]) / along,
        poisson_greatest=poisson[1] / along,
    )


def sphere_directions(count: int) -> FloatArray:
    """Unit vectors ``(3, count)`` spread evenly over the sphere (Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + np.sqrt(5)) * k
    flat = np.sqrt(1 - z**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z])


def youngs_extremes(stiffness: FloatArray) -> tuple[float, FloatArray, float, FloatArray]:
    """Least Young's modulus and its direction ``(3,)``, the greatest and its direction.

    Notes
    -----
    The best of 2000 directions, refined. Where several directions are equal, one of them.
    """
    start = sphere_directions(_STARTS)
    values = youngs_along(stiffness, start)
    scale = float(values.mean())
    extremes: list[tuple[float, FloatArray]] = []
    for sign, index in ((1.0, int(np.argmin(values))), (-1.0, int(np.argmax(values)))):

        def ranked(v: FloatArray, sign: float = sign) -> float:
            return sign * float(youngs_along(stiffness, v)) / scale

        best = minimize(ranked, start[:, index], method="Nelder-Mead", options={"xatol": 1e-7})
        n = np.asarray(best.x / np.linalg.norm(best.x))
        extremes.append((float(youngs_along(stiffness, n)), n))
    return (*extremes[0], *extremes[1])


def _across(n: FloatArray) -> FloatArray:
    """Two unit vectors ``(2, 3, ...)`` that are orthogonal to ``n`` and each other."""
    # The axis that n is furthest from, so that the cross product never vanishes.
    axis = np.eye(3)[np.argmin(np.abs(n), axis=0)]
    first = np.cross(n, np.moveaxis(axis, -1, 0), axis=0)
    first = first / np.linalg.norm(first, axis=0)
    return np.stack([first, np.cross(n, first, axis=0)])


def _eigenvalues(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of symmetric matrices ``(2, 2, ...)``, smaller first."""
    mean = 0.5 * (matrix[0, 0] + matrix[1, 1])
    spread = np.hypot(0.5 * (matrix[0, 0] - matrix[1, 1]), 0.5 * (matrix[0, 1] + matrix[1, 0]))
    return mean - spread, mean + spread
