"""Problem, history and result of sizing."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import DensityError
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.sizing.filter import DensityFilter, filtered
from gradedesign.mechanics.sizing.homogenised import lattice_mass, total_mass
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, built_density
from gradedesign.mechanics.sizing.members import (
    LEAST_MEMBER,
    MemberField,
    Members,
    mean_share,
    member_shares,
    with_members,
)

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class SizingStep:
    """One iteration of the history.

    ``mass_g`` is that of the lattice and of solid members, ``members_g`` that of these alone;
    ``utilisations`` are values over their limits, in the problem's order.
    """

    iteration: int
    mass_g: float
    mean_density: float
    utilisations: tuple[float, ...]
    change: float
    members_g: float = 0.0

    @property
    def utilisation(self) -> float:
        """Largest utilisation of any limit."""
        return max(self.utilisations, default=0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SizingProblem:
    """Sizing problem: least mass at which all limits hold.

    Raises `DensityError` if the bounds are empty; `ValueError` if a limit is not positive: one
    relative to the solid part that its analysis has not resolved yet.
    """

    model: HomogenisedModel
    limits: tuple[Limit, ...]
    #: Of every design variable; where ``windows`` is None, density bounds: the intersection of
    #: user, family and law.
    bounds: tuple[float, float]
    #: From design variables to element densities, rows summing to 1. One column is a uniform
    #: density.
    filter: DensityFilter
    #: Each ``(M,)``. Density bounds of every element, where they differ. A filtered
    #: variable then says how far from the lower to the upper of its element's bounds the density
    #: lies, as far as it lies itself between ``bounds``: no density leaves its element's bounds,
    #: and none jumps where they do not.
    windows: tuple[FloatArray, FloatArray] | None = None
    #: Solid members among the lattice, further variables; None: lattice alone.
    members: Members | None = None
    target: float = 1.0  #: Utilisation of the governing limit that sizing aims at, just below 1.

    def __post_init__(self) -> None:
        lo, hi = self.bounds
        if not 0 < lo <= hi < 1:
            raise DensityError(
                f"density bounds [{lo:g}, {hi:g}] are empty; expected 0 < lo <= hi < 1"
            )
        if self.windows is not None and not (
            lo < hi and (self.windows[0] > 0).all() and (self.windows[0] <= self.windows[1]).all()
        ):
            raise DensityError("density bounds of some elements are empty; expected lo <= hi")
        for limit in self.limits:
            if not limit.allowed > 0:
                raise ValueError(
                    f"limit on {limit.name} ({limit.key.load_case}) is {limit.allowed:g} "
                    f"{limit.unit}; expected a positive value"
                )


def sizing_step(
    problem: SizingProblem,
    rho: FloatArray,
    iteration: int,
    utilisations: tuple[float, ...],
    change: float,
    share: FloatArray | None = None,
) -> SizingStep:
    """History entry of densities ``(M,)`` and of the shares of solid members."""
    weights = problem.model.lattice_volumes
    return SizingStep(
        iteration=iteration,
        mass_g=designed_mass(problem.model, rho, share) * 1e6,
        mean_density=float(weights @ built_density(problem.model, rho) / weights.sum()),
        utilisations=utilisations,
        change=change,
        members_g=0.0
        if share is None
        else problem.model.material.density * float(weights @ mean_share(share)) * 1e6,
    )


def designed_mass(model: HomogenisedModel, rho: FloatArray, share: FloatArray | None) -> float:
    """Mass of the lattice and of solid members, t: without what stays solid in any case.

    ``model``: without the members.
    """
    if share is None:
        return lattice_mass(model, rho)
    passive = model.material.density * float(model.volumes @ model.solid_fraction)
    return total_mass(with_members(model, share), rho) - passive


def density_variables(problem: SizingProblem, x: FloatArray) -> FloatArray:
    """The variables of densities among all ``(n,)``; those of members follow."""
    return x[: problem.filter.shape[1]]


def member_variables(problem: SizingProblem, x: FloatArray) -> FloatArray:
    """Variables of members, 0 to 1, which enter with `LEAST_MEMBER` added."""
    return np.asarray(x[problem.filter.shape[1] :] - LEAST_MEMBER)


def element_shares(problem: SizingProblem, x: FloatArray) -> FloatArray | None:
    """Shares of solid members ``(4 M,)`` of design variables ``(n,)``; None: there are none."""
    if problem.members is None:
        return None
    return member_shares(problem.members, member_variables(problem, x))


def member_field(problem: SizingProblem, x: FloatArray) -> MemberField | None:
    """Field of members, of whose filtered values their shares are steps; None without any."""
    if problem.members is None:
        return None
    members = problem.members
    return MemberField(member_variables(problem, x), members.radius, threshold=members.threshold)


def variable_bounds(problem: SizingProblem) -> tuple[FloatArray, FloatArray]:
    """Bounds ``(n,)`` of all design variables."""
    members = 0 if problem.members is None else problem.members.filter.shape[1]
    count, (lo, hi) = (problem.filter.shape[1], members), problem.bounds
    return (
        np.repeat([lo, LEAST_MEMBER], count),
        np.repeat([hi, 1.0 + LEAST_MEMBER], count),
    )


def element_densities(problem: SizingProblem, x: FloatArray) -> FloatArray:
    """Densities ``(M,)`` of design variables ``(n,)``."""
    variables = filtered(problem.filter, density_variables(problem, x))
    if problem.windows is None:
        return variables
    low, slope = problem.windows[0], density_slope(problem)
    return np.clip(low + slope * (variables - problem.bounds[0]), *problem.windows)


def density_slope(problem: SizingProblem) -> FloatArray:
    """Derivative of every element's density by its filtered variable, ``(M,)``."""
    if problem.windows is None:
        return np.ones(problem.filter.shape[0])
    lo, hi = problem.bounds
    return np.asarray((problem.windows[1] - problem.windows[0]) / (hi - lo))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SizingResult:
    """A density per tetrahedron with the history that led to it."""

    rho: FloatArray  #: ``(M,)``. Density of every tetrahedron.
    #: ``(n,)``. Design variables, see `element_densities` and `member_variables`.
    variables: FloatArray
    history: tuple[SizingStep, ...]  #: The last step is that of ``rho``.
    #: Iteration ended because nothing changed any more, not because iterations ran out.
    converged: bool
    #: Every limit holds at ``rho`` on the homogenised part with its corrections: each utilisation
    #: is at most 1. The aim, `SizingProblem.target`, does not enter: a design between aim and limit
    #: is feasible, one a thousandth beyond a limit is not.
    feasible: bool
    members: MemberField | None = None  #: Of solid members; None: lattice alone.

    def __post_init__(self) -> None:
        object.__setattr__(self, "rho", locked(self.rho, (None,), name="rho"))
        object.__setattr__(self, "variables", locked(self.variables, (None,), name="variables"))


def sizing_result(
    problem: SizingProblem, x: FloatArray, history: Sequence[SizingStep], *, converged: bool
) -> SizingResult:
    """Result for design variables ``(n,)`` that the last step of the history evaluated."""
    log.info("sizing ended after %d iterations, converged=%s", len(history), converged)
    return SizingResult(
        rho=element_densities(problem, x),
        variables=x,
        history=tuple(history),
        converged=converged,
        feasible=history[-1].utilisation <= 1.0,
        members=member_field(problem, x),
    )
