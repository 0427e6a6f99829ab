"""A density at every point from the stress in the solid part."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.scaling_law import ScalingLaw, check_density_window

#: Densities of the table that is inverted, 1/4000 of the window apart. Chosen, not measured.
_TABLE = 4001


def density_from_stress(
    law: ScalingLaw,
    von_mises: FloatArray,
    permitted: float,
    *,
    bounds: tuple[float, float] | None = None,
    above: Literal["raise", "limit"] = "raise",
) -> FloatArray:
    """Smallest density within bounds whose strength holds the stress, point by point.

    Parameters
    ----------
    von_mises : (...) array, MPa
        In the fully solid part.
    permitted : float, MPa
        In the base material.
    bounds : (float, float), optional
        Densities to stay within; the law's window by default.
    above : {"raise", "limit"}
        What to do where the upper bound is not strong enough: raise, or use the upper bound, as
        a start for an iteration that checks the limit itself.

    Returns
    -------
    (...) array

    Raises
    ------
    DensityError
        If the bounds leave the law's window; with ``above="raise"`` if a point needs more.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, component Relative_Density_from_FEA, which clamps.
    """
    lower, upper = law.window if bounds is None else bounds
    check_density_window(law, lower, upper)
    stress = np.asarray(von_mises, dtype=np.float64)
    if not (np.isfinite(stress).all() and permitted > 0):
        raise DensityError(
            f"densities cannot follow from stresses that are not finite or a permitted stress of "
            f"{permitted:g} MPa; expected finite stresses and a positive limit"
        )
    rho = np.linspace(lower, upper, _TABLE)
    strength = law.strength(rho) * permitted
    too_much = stress > strength[-1]
    if above == "raise" and too_much.any():
        raise DensityError(
            f"{int(np.count_nonzero(too_much))} of {stress.size} points reach up to "
            f"{stress.max():.4g} MPa, but density {upper:g} of law '{law.name}' carries only "
            f"{strength[-1]:.4g} MPa; raise the density bound or the permitted stress"
        )
    return np.asarray(np.interp(stress, strength, rho))
