"""A density at every point from the stress in the solid part."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.material.scaling_law import ScalingLaw

#: Densities of the table that is inverted, 1/4000 of the window apart. Chosen, not measured.
_TABLE = 4001


def density_from_stress(
    law: ScalingLaw,
    von_mises: FloatArray,
    permitted: float,
) -> FloatArray:
    """Smallest density in a law's window whose strength holds the stress, point by point.

    Where the densest is not strong enough, that one, as a start for an iteration that checks the
    limit itself. Raises `DensityError` if a stress is not finite, or nothing is permitted. Returns
    ``(...)``.

    ``von_mises (...)``, MPa: in the fully solid part. ``permitted``, MPa: in the base material.

    References
    ----------
    Ramirez Salazar, thesis, Grenoble 2022, component Relative_Density_from_FEA, which clamps.
    """
    stress = np.asarray(von_mises, dtype=np.float64)
    if not (np.isfinite(stress).all() and permitted > 0):
        raise DensityError(
            f"densities cannot follow from stresses that are not finite or a permitted stress of "
            f"{permitted:g} MPa; expected finite stresses and a positive limit"
        )
    rho = np.linspace(*law.window, _TABLE)
    return np.asarray(np.interp(stress, law.strength(rho) * permitted, rho))
