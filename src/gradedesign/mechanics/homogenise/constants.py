"""Engineering constants, averages, anisotropy and rotation of a stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineeringConstants:
    """Moduli along the axes of a stiffness, in its unit."""

    youngs: tuple[float, float, float]  #: E along x, y, z.
    shear: tuple[float, float, float]  #: G of yz, xz, xy.
    #: Contraction along z under tension along y, z under x, y under x.
    poisson: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class IsotropicAverages:
    """Bulk and shear moduli of a polycrystal: Voigt, Reuss and Hill, and Hill's E and nu."""

    bulk_voigt: float
    bulk_reuss: float
    shear_voigt: float
    shear_reuss: float

    @property
    def bulk(self) -> float:
        """Hill's bulk modulus."""
        return 0.5 * (self.bulk_voigt + self.bulk_reuss)

    @property
    def shear(self) -> float:
        """Hill's shear modulus."""
        return 0.5 * (self.shear_voigt + self.shear_reuss)

    @property
    def youngs(self) -> float:
        """Young's modulus of Hill's averages."""
        return 9 * self.bulk * self.shear / (3 * self.bulk + self.shear)

    @property
    def poisson(self) -> float:
        """Poisson ratio of Hill's averages."""
        return (3 * self.bulk - 2 * self.shear) / (6 * self.bulk + 2 * self.shear)


def solid_stiffness(poissons_ratio: float) -> FloatArray:
    """Stiffness ``(6, 6)`` of the base material at unit Young's modulus.

    Examples
    --------
    >>> solid_stiffness(0.25)[0, :2].round(3).tolist()
    [1.2, 0.4]
    """
    nu = poissons_ratio
    lam, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    c = np.diag([2 * mu] * 3 + [mu] * 3)
    c[:3, :3] += lam
    return c


def engineering_constants(stiffness: FloatArray) -> EngineeringConstants:
    """Young's and shear moduli and Poisson ratios along the axes of ``(6, 6)``.

    Examples
    --------
    >>> round(engineering_constants(solid_stiffness(0.3)).poisson[0], 6)
    0.3
    """
    s = np.linalg.inv(stiffness)
    x, y, z, yz, xz, xy = (float(1 / v) for v in np.diag(s))
    return EngineeringConstants(
        youngs=(x, y, z),
        shear=(yz, xz, xy),
        poisson=(float(-s[1, 2] * y), float(-s[0, 2] * x), float(-s[0, 1] * x)),
    )


def isotropic_averages(stiffness: FloatArray) -> IsotropicAverages:
    """Averages over all orientations of a stiffness ``(6, 6)``.

    Examples
    --------
    >>> round(isotropic_averages(solid_stiffness(0.3)).bulk, 4)
    0.8333

    References
    ----------
    R. Hill, Proc. Phys. Soc. A 65 (1952) 349.
    """
    c, s = stiffness, np.linalg.inv(stiffness)
    a, b, d = (np.trace(c[:3, :3]) / 3, (c[0, 1] + c[0, 2] + c[1, 2]) / 3, np.trace(c[3:, 3:]) / 3)
    p, q, r = (np.trace(s[:3, :3]) / 3, (s[0, 1] + s[0, 2] + s[1, 2]) / 3, np.trace(s[3:, 3:]) / 3)
    return IsotropicAverages(
        bulk_voigt=float((a + 2 * b) / 3),
        bulk_reuss=float(1 / (3 * p + 6 * q)),
        shear_voigt=float((a - b + 3 * d) / 5),
        shear_reuss=float(5 / (4 * p - 4 * q + 3 * r)),
    )


def zener_ratio(stiffness: FloatArray) -> float:
    """``2 C44 / (C11 - C12)`` with each entry averaged over its three equivalents.

    Examples
    --------
    >>> round(zener_ratio(solid_stiffness(0.3)), 6)
    1.0
    """
    c = stiffness
    normal = np.trace(c[:3, :3]) / 3 - (c[0, 1] + c[0, 2] + c[1, 2]) / 3
    return float(2 * np.trace(c[3:, 3:]) / 3 / normal)


def youngs_along(stiffness: FloatArray, direction: FloatArray) -> FloatArray:
    """Young's modulus along directions ``(3, ...)``, ``(...)``.

    Examples
    --------
    >>> diagonal = np.array([1.0, 1.0, 1.0]) / 3**0.5
    >>> round(float(youngs_along(solid_stiffness(0.3), diagonal)), 6)
    1.0
    """
    n = direction / np.linalg.norm(direction, axis=0)
    v = np.stack([n[0] ** 2, n[1] ** 2, n[2] ** 2, n[1] * n[2], n[0] * n[2], n[0] * n[1]])
    s = np.linalg.inv(stiffness)
    return np.asarray(1 / np.einsum("a...,ab,b...->...", v, s, v))
