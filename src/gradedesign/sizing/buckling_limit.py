"""The limit on buckling of the cells of the homogenised lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.material.buckling_law import BucklingLaw
from gradedesign.sizing.homogenised_model import HomogenisedModel, held_density
from gradedesign.sizing.lattice_stress import LatticeStress


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BucklingLimit:
    """The macroscopic stress times a factor must not buckle a cell.

    Attributes
    ----------
    law : BucklingLaw
    factor : float
        Required critical stress over the acting one.
    """

    law: BucklingLaw
    factor: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BucklingUse:
    """The largest use of a limit on buckling: 1 where it is just met.

    Attributes
    ----------
    value : float
    element : int
    load_case : str
    """

    value: float
    element: int
    load_case: str


def buckling_use(
    limit: BucklingLimit,
    model: HomogenisedModel,
    rho: FloatArray,
    stress: Sequence[LatticeStress],
) -> BucklingUse:
    """Largest use over all tetrahedra that hold lattice, and all load cases.

    Clamped edges are not excluded: unlike a yielding point, a buckling cell spreads. In denser
    cells than the law knows its last critical stress is used, see `BucklingLaw`.
    """
    uses = np.stack([_use(limit, case, held_density(model, rho)) for case in stress])
    uses = np.where(model.solid_share < 1, uses, 0.0)
    case, element = np.unravel_index(int(np.argmax(uses)), uses.shape)
    return BucklingUse(
        value=float(uses[case, element]),
        element=int(element),
        load_case=model.cases[int(case)].name,
    )


def density_for_buckling(
    limit: BucklingLimit,
    model: HomogenisedModel,
    stress: Sequence[LatticeStress],
    *,
    allowance: float = 1.0,
) -> FloatArray:
    """Density at which the present macroscopic stress just uses the limit, ``(M,)``.

    ``allowance`` scales the limit. The top of the law of stiffness where no density suffices.
    """
    window = model.law.window
    held = np.max(
        [
            limit.law.least_density(case.buckling, allowance / limit.factor, window)
            for case in stress
        ],
        axis=0,
    )
    return held if model.fill is None else model.fill.asked_for(held)


def _use(limit: BucklingLimit, case: LatticeStress, held: FloatArray) -> FloatArray:
    return limit.factor * limit.law.at(case.buckling, held)
