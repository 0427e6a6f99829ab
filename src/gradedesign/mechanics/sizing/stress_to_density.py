"""The plain method: the stress of the fully solid part, mapped to density by the cell's law.

At every point the density is the least at which the law bears the stress that the solid part has
there, the largest of all load cases. One factor on that stress is left: the least with which every
limit holds on the homogenised part, so stress and stiffness alike. Explicit analyses correct what
the homogenised part predicts, and with it the factor, until stress and deflection hold. By a power
law ``strength = c rho^n`` a factor f on the stress is one of ``f^(1/n)`` on the density.

That is what is done by hand (Ramirez Salazar, thesis, Grenoble 2022, component
Relative_Density_from_FEA and section 4.4). The pattern never changes: density goes where the solid
part is stressed, not where it is most worth for a limit, which `size` finds by gradients.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import brentq

from gradedesign.arrays import FloatArray
from gradedesign.errors import DensityError
from gradedesign.mechanics.fe.solution import Solution
from gradedesign.mechanics.fe.stiffness import IsotropicStiffness
from gradedesign.mechanics.sizing.filter import filtered
from gradedesign.mechanics.sizing.lattice_stress import (
    LatticeStress,
    least_density,
    local_stress_at,
    stress_demand,
)
from gradedesign.mechanics.sizing.mean_density import size_by_mean_density
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingResult, SizingStep

#: Stress below this share of the largest is taken for none: where all that is more stressed stands
#: at its greatest density, the factor grows no further. Chosen, not measured.
_NO_STRESS = 1e-3
#: Relative tolerance of the factor: hundred times finer than that of sizing on the limits.
_FACTOR_TOLERANCE = 1e-5


def size_by_stress(
    problem: SizingProblem,
    solid: Sequence[Solution],
    allowed: float | None = None,
    *,
    start: float | None = None,
    max_iterations: int = 60,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Least factor on the stress of the solid part with which every limit holds.

    Raises `DensityError` if the law has no strength, or the solid part no stress where lattice is.
    Returns SizingResult: its one variable is the factor.

    - ``problem``: with a filter of a variable for each density, which averages them over the cells
      nearby
    - ``solid``: of the fully solid part, in every load case
    - ``allowed``, MPa: stress that the solid material may have, to which a factor of 1 belongs; by
      default that of the most stressed point at its greatest density
    - ``start``: factor to look at first, such as that of an earlier iteration; by default the one
      with which the law's densities use the stress up to the target
    - ``max_iterations``: analyses at most
    """
    model = problem.model
    weights = model.lattice_volumes / model.lattice_volumes.sum()
    stress = solid_demand(problem, solid)
    at_low, at_high = _largest_stress(problem, stress)
    # All densities stand at their lower bound, or all of stressed lattice at their upper one.
    weak, strong = np.log(at_low), np.log(_NO_STRESS * at_high)

    def mean_of(log_permitted: float) -> float:
        return float(weights @ mapped_density(problem, stress, np.exp(log_permitted)))

    bounds = mean_of(weak), mean_of(strong)

    @cache
    def permitted_for(mean: float) -> float:
        """Logarithm of the stress in the solid with which the map has a mean density."""
        if not bounds[0] < mean < bounds[1]:
            return float(weak if mean <= bounds[0] else strong)
        return float(brentq(lambda x: mean_of(x) - mean, strong, weak, xtol=_FACTOR_TOLERANCE))

    one = at_high if allowed is None else allowed
    sized = size_by_mean_density(
        problem,
        lambda mean: mapped_density(problem, stress, np.exp(permitted_for(mean))),
        bounds,
        start=mean_of(np.log(one / start if start else one * problem.target)),
        max_iterations=max_iterations,
        on_step=on_step,
    )
    factor = one / np.exp(permitted_for(float(sized.variables[0])))
    return replace(sized, variables=np.array([factor]))


def solid_demand(problem: SizingProblem, solid: Sequence[Solution]) -> tuple[LatticeStress, ...]:
    """Stress of the fully solid part as the laws of the lattice read it, in every load case."""
    model = problem.model
    modulus = np.full(model.space.element_count, model.material.youngs_modulus)
    stiffness = IsotropicStiffness(E=modulus, nu=model.material.poissons_ratio)
    return stress_demand(model, stiffness, {s.name: s.displacement for s in solid})


def mapped_density(
    problem: SizingProblem, stress: Sequence[LatticeStress], permitted: float
) -> FloatArray:
    """Densities at which the law bears a stress with ``permitted`` MPa in the solid, ``(M,)``.

    The greatest of all load cases, within the density bounds of every tetrahedron, averaged over
    the cells nearby as the filter says.
    """
    low, high = problem.bounds if problem.windows is None else problem.windows
    wanted = np.max([least_density(problem.model, one, permitted) for one in stress], axis=0)
    return np.clip(filtered(problem.filter, np.clip(wanted, low, high)), low, high)


def _largest_stress(problem: SizingProblem, stress: Sequence[LatticeStress]) -> tuple[float, float]:
    """Largest stress in the solid by the law with all densities at a bound, lower and upper, MPa.

    Raises `DensityError` if there is none.
    """
    model = problem.model
    lattice = model.lattice_volumes > 0
    low, high = (
        max(
            float(local_stress_at(model, one, np.broadcast_to(end, lattice.shape))[lattice].max())
            for one in stress
        )
        for end in (problem.bounds if problem.windows is None else problem.windows)
    )
    if not high > 0:
        raise DensityError(
            "the fully solid part has no stress where lattice is, so none can be mapped to "
            'density; expected loads that stress it, or [lattice] method = "lightest"'
        )
    return low, high
