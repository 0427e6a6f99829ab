"""One density for the whole part, from the analysis of the solid part."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from gradedesign.errors import DensityError
from gradedesign.mechanics.material.power_fit import softest_modulus
from gradedesign.mechanics.material.scaling_law import ScalingLaw


def density_for_stiffness(law: ScalingLaw, share: float) -> float:
    """Smallest density of the law's window that holds a limit on what falls with the stiffness.

    Displacements and work of the solid part are scaled by ``1 / E*``, which is exact for a
    homogeneous, isotropic cellular copy of the part. Raises `DensityError` if the window's upper
    end is not enough. Returns float: the window's lower end where that is enough already.

    ``share``: value over limit of the fully solid part.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.8 and 1.10 (rule of Azman).
    """
    return _smallest_density(
        law,
        lambda rho: float(softest_modulus(law, np.asarray(rho, dtype=np.float64))),
        share,
        "stiffness",
    )


def density_for_strength(law: ScalingLaw, share: float) -> float:
    """Smallest density of the law's window that holds a limit on stress.

    Raises `DensityError` if the window's upper end is not enough. Returns float: the window's lower
    end where that is enough already.

    ``share``: stress over permitted stress of the fully solid part.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, eqs. 1.9 and 1.11.

    Examples
    --------
    The beam of section 4.3:

    >>> from gradedesign.mechanics.material.power_law import power_law
    >>> from gradedesign.mechanics.material.scaling_law import LawOrigin
    >>> origin = LawOrigin(kind="fe", source="table 4.1", test="4x4x4 cells")
    >>> law = power_law("g", ("test-wall",), youngs=(0.402, 1.176), strength=(0.426, 1.537),
    ...                 window=(0.125, 0.624), origin=origin)
    >>> round(density_for_strength(law, 3.6705 / 50.0), 3)
    0.319
    """
    return _smallest_density(
        law, lambda rho: float(law.strength(np.asarray(rho, dtype=np.float64))), share, "strength"
    )


def _smallest_density(
    law: ScalingLaw, curve: Callable[[float], float], share: float, quantity: str
) -> float:
    """Invert an increasing curve over the law's window."""
    if not (np.isfinite(share) and share >= 0):
        raise DensityError(
            f"{share:g} of the solid's {quantity} gives no density; expected a share of 0 or more"
        )
    lower, upper = law.window
    if curve(lower) >= share:
        return lower
    most = curve(upper)
    if most < share:
        raise DensityError(
            f"needs {share:.4g} of the solid's {quantity}, but law '{law.name}' reaches only "
            f"{most:.4g} at the end of its window, density {upper:g}; use a law that reaches "
            f"further, or loosen the limit"
        )
    return float(brentq(lambda rho: curve(rho) - share, lower, upper, xtol=1e-12))
