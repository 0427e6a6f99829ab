"""The design variables that move any lattice, and their cost in volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.mechanics.sizing.filter import DensityFilter, collected
from gradedesign.mechanics.sizing.homogenised import solid_slope
from gradedesign.mechanics.sizing.problem import SizingProblem, density_slope


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeltVariables:
    """The design variables that move any lattice.

    Attributes
    ----------
    active : (n,) bool array
    cost : (n,) array, mm^3
        Solid volume per unit of each variable.
    slope : (M,) array
        Derivative of every density by its filtered variable.
    sums : (n,) array
        Column sums of the filter.
    """

    active: BoolArray
    cost: FloatArray
    slope: FloatArray
    sums: FloatArray


def felt_variables(problem: SizingProblem) -> FeltVariables:
    """The design variables that move any lattice, and their cost in volume."""
    weights = problem.model.lattice_volumes
    # Mass per asked density: at the middle of the bounds, where cells at faces hold more or less.
    low, high = problem.windows or problem.bounds
    slope = density_slope(problem)
    per_nominal = solid_slope(problem.model, np.sqrt(low * high) * np.ones_like(slope))
    cost = collected(problem.filter, weights * per_nominal * slope)
    return FeltVariables(
        active=cost > 0,
        cost=cost,
        slope=slope,
        sums=collected(problem.filter, np.ones(weights.shape)),
    )


def first_variables(
    problem: SizingProblem, felt: FeltVariables, start: FloatArray | None
) -> FloatArray:
    """Initial variables; those that move no lattice stay at the lower bound."""
    lo, hi = problem.bounds
    x = np.full(problem.filter.shape[1], np.sqrt(lo * hi)) if start is None else start
    return np.where(felt.active, np.clip(x, lo, hi), lo)


def variable_floor(
    density_filter: DensityFilter, sums: FloatArray, floor: FloatArray, lo: float
) -> FloatArray:
    """Lower bound of each variable: the filter-weighted mean of those of its elements.

    ``sums`` are the filter's column sums.
    """
    mean = collected(density_filter, floor) / np.where(sums > 0, sums, 1.0)
    return np.maximum(np.where(sums > 0, mean, lo), floor)
