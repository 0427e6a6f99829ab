"""The solid of lattice densities, before it is built."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.resolve.setup import Setup
from gradedesign.verify.analysis import PlannedSolid


def planned_solid(setup: Setup, rho: float | FloatArray) -> PlannedSolid:
    """Box and volume of the solid that a design will have.

    Parameters
    ----------
    setup : Setup
    rho : float or (M,) array
        Relative density of the lattice, for every element of the part.
    """
    share = setup.model.solid_fraction
    x, y, z = np.ptp(setup.problem.part.surface.vertices, axis=0).tolist()
    return PlannedSolid(
        box=(x, y, z),
        volume=float(setup.model.volumes @ (share + (1.0 - share) * rho)),
        load_cases=len(setup.problem.case.load_case),
    )
