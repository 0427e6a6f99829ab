"""Bounds that the stiffness of any porous solid keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise.constants import isotropic_averages, solid_stiffness

#: By how much rounding may break a bound, in the solid's Young's modulus.
_SLACK = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundCheck:
    """One bound, and whether a stiffness keeps it."""

    name: str
    value: float  #: Over the base material's Young's modulus.
    #: Between which the value must lie; ``inf`` where there is no limit.
    lower: float
    upper: float

    @property
    def holds(self) -> bool:
        """Whether the value lies between the limits, to rounding."""
        return self.lower - _SLACK <= self.value <= self.upper + _SLACK


def hashin_shtrikman_upper(rho: float, poissons_ratio: float) -> tuple[float, float]:
    """Largest bulk and shear modulus of an isotropic solid with voids, over the solid's E.

    Examples
    --------
    >>> [round(value, 4) for value in hashin_shtrikman_upper(1.0, 0.25)]
    [0.6667, 0.4]

    References
    ----------
    Z. Hashin, S. Shtrikman, J. Mech. Phys. Solids 11 (1963) 127.
    """
    nu = poissons_ratio
    bulk, shear = 1 / (3 * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    void = 1 - rho
    if void <= 0:
        return bulk, shear
    upper = bulk + void / (-1 / bulk + rho / (bulk + 4 / 3 * shear))
    zeta = 2 * rho * (bulk + 2 * shear) / (5 * shear * (bulk + 4 / 3 * shear))
    return upper, shear + void / (-1 / shear + zeta)


def check_bounds(stiffness: FloatArray, rho: float, poissons_ratio: float) -> list[BoundCheck]:
    """Compare a stiffness with the bounds of a solid with voids.

    ``stiffness (6, 6)``: over the base material's Young's modulus. ``rho``: relative density.

    Returns
    -------
    list of BoundCheck
        Voigt's and Reuss' bounds in the sense of energies (the least eigenvalue of
        ``rho C_solid - C``, and of ``C``, as Reuss' bound is zero beside void), their bulk and
        shear moduli, and those of Hashin and Shtrikman: on the bulk modulus, which orientation
        does not change, and on Reuss' and Hill's averages.

    Examples
    --------
    >>> from gradedesign.mechanics.homogenise.constants import solid_stiffness
    >>> checks = check_bounds(0.1 * solid_stiffness(0.3), 0.3, 0.3)
    >>> all(check.holds for check in checks)
    True
    """
    solid = solid_stiffness(poissons_ratio)
    means = isotropic_averages(stiffness)
    bulk, shear = hashin_shtrikman_upper(rho, poissons_ratio)
    nu = poissons_ratio
    least = float(np.linalg.eigvalsh(stiffness)[0])
    gap = float(np.linalg.eigvalsh(rho * solid - stiffness)[0])
    return [
        BoundCheck(name="Reuss, energy", value=least, lower=0.0, upper=np.inf),
        BoundCheck(name="Voigt, energy", value=gap, lower=0.0, upper=np.inf),
        _upper("Voigt, bulk", means.bulk_voigt, rho / (3 * (1 - 2 * nu))),
        _upper("Voigt, shear", means.shear_voigt, rho / (2 * (1 + nu))),
        _upper("Hashin-Shtrikman, Reuss bulk", means.bulk_reuss, bulk),
        _upper("Hashin-Shtrikman, Hill bulk", means.bulk, bulk),
        _upper("Hashin-Shtrikman, Reuss shear", means.shear_reuss, shear),
        _upper("Hashin-Shtrikman, Hill shear", means.shear, shear),
    ]


def require_bounds(
    stiffness: FloatArray, rho: float, poissons_ratio: float, *, subject: str = "the cell"
) -> None:
    """Refuse a stiffness that no solid of this density can have, see `check_bounds`.

    Raises `SolverError` naming the bound, the value and the limit.
    """
    if not np.allclose(stiffness, stiffness.T, rtol=0, atol=1e-8):
        raise SolverError(f"the stiffness of {subject} is not symmetric")
    least = float(np.linalg.eigvalsh(stiffness)[0])
    if least <= 0:
        raise SolverError(
            f"the stiffness of {subject} at density {rho:g} has an eigenvalue of {least:g}, "
            f"expected only positive ones: the cell has a mechanism or the solve failed"
        )
    for bound in check_bounds(stiffness, rho, poissons_ratio):
        if not bound.holds:
            raise SolverError(
                f"the stiffness of {subject} at density {rho:g} breaks a bound ({bound.name}): "
                f"{bound.value:.6g} of the solid's modulus, expected {bound.lower:.6g} to "
                f"{bound.upper:.6g}; the density or the analysis is wrong"
            )


def _upper(name: str, value: float, limit: float) -> BoundCheck:
    """Check a modulus of a solid with voids: between nothing and a limit."""
    return BoundCheck(name=name, value=value, lower=0.0, upper=limit)
