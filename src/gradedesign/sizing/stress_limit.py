"""The stress limit on the homogenised lattice, and the density it asks for at a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from gradedesign.arrays import BoolArray, FloatArray, locked
from gradedesign.fe.stress import weighted_percentile
from gradedesign.sizing.homogenised_model import HomogenisedModel, held_density
from gradedesign.sizing.lattice_stress import LatticeStress, least_density, local_stress_at


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StressLimit:
    """Von Mises stress in the solid material of the lattice must stay below a limit.

    Attributes
    ----------
    limit : float, MPa
    percentile : float
        Volume percentile that is judged.
    considered : (M,) bool array
        Elements outside the exclusion radius of clamped regions.
    factor : float
        Correction of the predicted local stress from explicit analyses; 1 at first.
    """

    limit: float
    percentile: float
    considered: BoolArray
    factor: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "considered", locked(self.considered, (None,), dtype=np.bool_, name="considered")
        )


def stress_measure(
    limit: StressLimit,
    model: HomogenisedModel,
    rho: FloatArray,
    stress: Sequence[LatticeStress],
) -> float:
    """Volume percentile of the predicted local stress over the considered lattice, MPa.

    The largest of the load cases, as explicit analyses are judged.
    """
    held = held_density(model, rho)
    weights = model.lattice_volumes * held * limit.considered
    if weights.sum() <= 0:
        return 0.0
    return limit.factor * max(
        _volume_percentile(model, rho, local_stress_at(model, case, rho), weights, limit.percentile)
        for case in stress
    )


def _volume_percentile(
    model: HomogenisedModel,
    rho: FloatArray,
    local: FloatArray,
    weights: FloatArray,
    percentile: float,
) -> float:
    """Percentile of the local stress over all solid of the lattice, MPa.

    Where the law knows how the stress is distributed inside a cell, these distributions are mixed;
    else every tetrahedron counts with the one local stress it has, which is too high where the
    stress varies: half a per cent of a few cells is not half a per cent of the lattice.
    """
    law, used = model.law.local_stress, (weights > 0) & (local > 0)
    if law is None or not law.has_distribution or not used.any():
        return weighted_percentile(local, weights, percentile)
    density = np.clip(held_density(model, rho)[used], *model.law.window)
    some, weight = local[used], weights[used] / weights.sum()

    def excess(log_stress: float) -> float:
        above = law.volume_above(np.exp(log_stress) / some, density)
        return float(np.log(weight @ above / (1 - percentile / 100)))

    low, high = np.log(some.min()) - 20.0, np.log(some.max()) + 5.0
    if percentile >= 100.0 or excess(low) <= 0:
        return weighted_percentile(local, weights, percentile)
    return float(np.exp(brentq(excess, low, high, xtol=1e-9)))


def stress_use(
    limit: StressLimit | None,
    model: HomogenisedModel,
    rho: FloatArray,
    stress: Sequence[LatticeStress],
) -> float:
    """Stress measure divided by its limit; 0 without a limit."""
    return 0.0 if limit is None else stress_measure(limit, model, rho, stress) / limit.limit


def density_for_stress(
    limit: StressLimit,
    model: HomogenisedModel,
    stress: Sequence[LatticeStress],
    *,
    allowance: float = 1.0,
) -> FloatArray:
    """Density at which the present macroscopic stress just uses the limit, ``(M,)``.

    ``allowance`` scales the limit at a point: the limit is a percentile, so a small volume may
    exceed it. Elements that are not considered ask for nothing. Points that need more than the
    law's window offers take its top; the limit is judged later.
    """
    permitted = limit.limit * allowance / limit.factor
    wanted = np.max([least_density(model, case, permitted) for case in stress], axis=0)
    return np.where(limit.considered, wanted, 0.0)
