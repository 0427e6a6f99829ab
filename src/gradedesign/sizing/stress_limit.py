"""The stress limit on the homogenised lattice, and the density it asks for at a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, locked
from gradedesign.fe.solution import Solution
from gradedesign.fe.stiffness import AnisotropicStiffness
from gradedesign.fe.stress import element_von_mises, weighted_percentile
from gradedesign.material.density_from_stress import density_from_stress
from gradedesign.sizing.homogenised import HomogenisedModel, lattice_stiffness


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

    def evaluate(
        self, model: HomogenisedModel, rho: FloatArray, solutions: Sequence[Solution]
    ) -> tuple[FloatArray, ...]:
        """Macroscopic von Mises stress of the lattice phase per load case, ``(M,)`` each, MPa."""
        return lattice_von_mises(model, rho, solutions)


def lattice_von_mises(
    model: HomogenisedModel, rho: FloatArray, solutions: Sequence[Solution]
) -> tuple[FloatArray, ...]:
    """Macroscopic von Mises stress in the lattice phase, element means, ``(M,)`` per case, MPa."""
    stiffness = AnisotropicStiffness(C=lattice_stiffness(model, rho))
    thermal = model.material.thermal_expansion
    by_name = {s.name: s for s in solutions}
    return tuple(
        element_von_mises(
            model.space,
            stiffness,
            by_name[case.name].displacement,
            thermal_strain=thermal * case.temperature_change,
        ).mean(axis=1)
        for case in model.cases
    )


def local_stress(
    limit: StressLimit, model: HomogenisedModel, rho: FloatArray, stress: Sequence[FloatArray]
) -> FloatArray:
    """Predicted stress in the solid material, envelope of the load cases, ``(M,)``, MPa."""
    envelope = np.max(np.stack(list(stress)), axis=0)
    return limit.factor * envelope / model.law.strength(rho)


def stress_measure(
    limit: StressLimit, model: HomogenisedModel, rho: FloatArray, stress: Sequence[FloatArray]
) -> float:
    """Volume percentile of the predicted local stress over the considered lattice, MPa."""
    weights = model.volumes * (1 - model.solid_share) * rho * limit.considered
    if weights.sum() <= 0:
        return 0.0
    return weighted_percentile(local_stress(limit, model, rho, stress), weights, limit.percentile)


def stress_use(
    limit: StressLimit | None,
    model: HomogenisedModel,
    rho: FloatArray,
    stress: Sequence[FloatArray],
) -> float:
    """Stress measure divided by its limit; 0 without a limit."""
    return 0.0 if limit is None else stress_measure(limit, model, rho, stress) / limit.limit


def density_for_stress(
    limit: StressLimit,
    model: HomogenisedModel,
    stress: Sequence[FloatArray],
    *,
    allowance: float = 1.0,
) -> FloatArray:
    """Density at which the present macroscopic stress just uses the limit, ``(M,)``.

    ``allowance`` scales the limit at a point: the limit is a percentile, so a small volume may
    exceed it. Elements that are not considered ask for nothing.
    """
    envelope = np.max(np.stack(list(stress)), axis=0) * limit.factor
    # Points that need more than the law's window offers take its top; the limit is judged later.
    wanted = density_from_stress(model.law, envelope, limit.limit * allowance, above="limit")
    return np.where(limit.considered, wanted, 0.0)
