"""Hooke's law of a base material: isotropic, or another one along the direction it is built in.

A material that is built in layers is transversely isotropic about the build direction. Of its five
constants publications give Young's modulus along and across it; the others follow from Poisson's
ratio, in both directions that of the material, and the shear modulus from Saint-Venant's relation
where it is not stated. With equal moduli all of them are those of the isotropic material.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class BuildStiffness:
    """Stiffness along the direction in which a solid is built, over that across it."""

    axis: int  #: 0, 1 or 2: x, y or z of the part, along which it is built, either way.
    along: float  #: Young's modulus along the axis over that across it.
    #: Shear modulus in planes that hold the axis over that in the planes across it; None:
    #: Saint-Venant's relation.
    shear: float | None = None


def stiffness_matrix(
    youngs_modulus: float, poissons_ratio: float, build: BuildStiffness | None = None
) -> FloatArray:
    """Stiffness ``(6, 6)``, MPa, in Voigt order xx, yy, zz, yz, zx, xy with engineering shear.

    ``youngs_modulus``, MPa: across the build direction where there is one. With E along, e across
    it and Poisson's ratio nu the compliances between both are ``-nu / sqrt(E e)``, symmetric, and
    the shear modulus is ``1 / (1/E + 1/e + 2 nu / sqrt(E e))``.

    References
    ----------
    A. Barré de Saint-Venant (1863), Sur la distribution des élasticités autour de chaque point d'un
    solide, J. Math. Pures Appl. 8, 353-430. S. G. Lekhnitskii (1963), Theory of elasticity of an
    anisotropic elastic body, section 9.

    Examples
    --------
    >>> stiffness_matrix(1.0, 0.25)[[0, 0, 5], [0, 1, 5]].round(3).tolist()
    [1.2, 0.4, 0.4]
    """
    moduli = np.full(3, youngs_modulus)
    if build is not None:
        moduli[build.axis] *= build.along
    each = 1.0 / np.sqrt(np.outer(moduli, moduli))
    compliance = np.zeros((6, 6))
    compliance[:3, :3] = np.where(np.eye(3, dtype=bool), each, -poissons_ratio * each)
    for shear, (one, other) in enumerate(((1, 2), (2, 0), (0, 1)), start=3):
        mixed = 2.0 * poissons_ratio * each[one, other]
        compliance[shear, shear] = 1.0 / moduli[one] + 1.0 / moduli[other] + mixed
        if build is not None and build.shear is not None and build.axis in (one, other):
            across = 2.0 * (1.0 + poissons_ratio) / youngs_modulus
            compliance[shear, shear] = across / build.shear
    return np.asarray(np.linalg.inv(compliance), dtype=np.float64)


def principal_moduli(matrix: FloatArray) -> FloatArray:
    """Couplings of normal stresses and strains, and shear moduli, ``(2, 3, 3)``, MPa.

    The first holds ``C_iijj``, the second ``C_ijij`` off its diagonal, which is 0: all that is in a
    stiffness ``matrix`` ``(6, 6)`` whose planes of symmetry lie across the axes.
    """
    yz, zx, xy = np.diagonal(matrix)[3:]
    shear = np.array([[0.0, xy, zx], [xy, 0.0, yz], [zx, yz, 0.0]])
    return np.stack([matrix[:3, :3], shear])
