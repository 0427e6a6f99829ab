"""One density for the whole part, from the analysis of the solid part."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from gradedesign.errors import DensityError
from gradedesign.material.power_fit import softest_modulus
from gradedesign.material.scaling_law import ScalingLaw


def density_for_displacement(law: ScalingLaw, displacement: float, permitted: float) -> float:
    """Smallest density of the law's window at which a displacement limit holds.

    The displacement of the solid part is scaled by ``1 / E*``, which is exact for a homogeneous,
    isotropic cellular copy of the part.

    Parameters
    ----------
    law : ScalingLaw
    displacement : float, mm
        Of the fully solid part.
    permitted : float, mm

    Returns
    -------
    float
        The window's lower end where that is enough already.

    Raises
    ------
    DensityError
        If the window's upper end is not enough.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.8 and 1.10 (rule of Azman).
    """
    return _smallest_density(
        law,
        lambda rho: float(softest_modulus(law, np.asarray(rho, dtype=np.float64))),
        _ratio("displacement", displacement, permitted, "mm"),
        f"a displacement of {displacement:g} mm when solid and a limit of {permitted:g} mm",
    )


def density_for_stress(law: ScalingLaw, von_mises: float, permitted: float) -> float:
    """Smallest density of the law's window at which a stress limit holds.

    Parameters
    ----------
    law : ScalingLaw
    von_mises : float, MPa
        Of the fully solid part.
    permitted : float, MPa

    Returns
    -------
    float
        The window's lower end where that is enough already.

    Raises
    ------
    DensityError
        If the window's upper end is not enough.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.9 and 1.11.

    Examples
    --------
    The beam of section 4.3:

    >>> from gradedesign.material.power_law import power_law
    >>> from gradedesign.material.scaling_law import LawOrigin
    >>> origin = LawOrigin(kind="fe", source="table 4.1", test="4x4x4 cells")
    >>> law = power_law("g", ("test-wall",), youngs=(0.402, 1.176), strength=(0.426, 1.537),
    ...                 window=(0.125, 0.624), origin=origin)
    >>> round(density_for_stress(law, 3.6705, 50.0), 3)
    0.319
    """
    return _smallest_density(
        law,
        lambda rho: float(law.strength(np.asarray(rho, dtype=np.float64))),
        _ratio("stress", von_mises, permitted, "MPa"),
        f"a stress of {von_mises:g} MPa when solid and a limit of {permitted:g} MPa",
    )


def _ratio(what: str, value: float, permitted: float, unit: str) -> float:
    """Value over limit, both checked."""
    if not (np.isfinite(value) and value >= 0 and np.isfinite(permitted) and permitted > 0):
        raise DensityError(
            f"a {what} of {value:g} {unit} with a limit of {permitted:g} {unit} gives no density; "
            f"expected a value of 0 or more and a positive limit"
        )
    return value / permitted


def _smallest_density(
    law: ScalingLaw, curve: Callable[[float], float], needed: float, what: str
) -> float:
    """Invert an increasing curve over the law's window."""
    lower, upper = law.window
    if curve(lower) >= needed:
        return lower
    most = curve(upper)
    if most < needed:
        raise DensityError(
            f"{what} need {needed:.4g} of the solid's, but law '{law.name}' reaches only "
            f"{most:.4g} at the end of its window, density {upper:g}; use a law that reaches "
            f"further, or loosen the limit"
        )
    return float(brentq(lambda rho: curve(rho) - needed, lower, upper, xtol=1e-12))
