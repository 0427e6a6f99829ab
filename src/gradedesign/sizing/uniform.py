"""The lightest uniform lattice: the least density of the whole part at which every limit holds.

One variable needs no gradient and no bound at every point. The limits are judged as they are for
any other design (largest displacements, volume percentile of the stress, most used cell), so that
the mass of a uniform lattice is the best that one density can do.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gradedesign.sizing.homogenised import lattice_mass
from gradedesign.sizing.problem import SizingProblem, SizingResult, SizingStep, sizing_result
from gradedesign.sizing.state import solved_state

log = logging.getLogger(__name__)

#: Utilisation falls about as this power of density; only the first steps of the search rest on it.
EXPONENT = 1.5
#: A step beyond the density that `EXPONENT` predicts, so that it lands on the other side.
BEYOND = 1.03
#: Relative width of the density interval at which the search ends where a utilisation jumps.
SAME_DENSITY = 1e-5
#: A utilisation that grows with density by more than this share is no rounding of the solver.
RISE = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class _End:
    """End of the bracket: density, logarithm of utilisation over target, iterations it stayed."""

    density: float
    value: float
    stayed: int = 0


def size_uniform(
    problem: SizingProblem,
    *,
    start: float | None = None,
    max_iterations: int = 60,
    tolerance: float = 0.004,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Least density in the bounds at which no limit is used to more than the target.

    Parameters
    ----------
    problem : SizingProblem
        With a filter of one column.
    start : float, optional
        Density at which to look after the lower bound, such as that of an earlier iteration.
    max_iterations : int
        Analyses at most; when they run out the least density that is known to hold is returned,
        else the last.
    tolerance : float
        The most used limit is used to between ``1 - tolerance`` and 1 of the target, unless the
        lower bound holds or the upper one does not.
    on_step : callable, optional

    Returns
    -------
    SizingResult

    Notes
    -----
    Brackets the density at which the largest utilisation crosses the target and closes in by regula
    falsi in the logarithms (Illinois variant), in which a power law is a straight line. Where loads
    do not grow with density the work of the loads falls with it; displacements of regions and
    stress percentiles usually do, without proof. Under inertia or thermal loads beside solid
    regions utilisations may rise first: the lower bound is looked at before anything else, and
    otherwise the crossing found is one from broken below to held above, not surely the lowest. A
    history in which a utilisation rises with density is logged as a warning.

    References
    ----------
    M. Dowell, P. Jarratt, BIT 11, 1971 (Illinois method).
    """
    lo, hi = problem.bounds
    history: list[SizingStep] = []

    def excess(density: float) -> float:
        """Logarithm of the largest utilisation over the target; -inf where nothing is used."""
        before = history[-1].mean_density if history else density
        step = _evaluate(problem, density, len(history), abs(density - before) / hi)
        history.append(step)
        if on_step is not None:
            on_step(step)
        with np.errstate(divide="ignore"):
            return float(np.log(step.utilisation / problem.target))

    def result_at(density: float, *, converged: bool) -> SizingResult:
        if history[-1].mean_density != density:
            excess(density)
        _warn_of_rises(history)
        return sizing_result(problem, np.array([density]), history, converged=converged)

    low = _End(density=lo, value=excess(lo))
    if low.value <= 0 or lo == hi:
        return result_at(lo, converged=True)
    # `low` breaks a limit from here on; `high`, once known, holds every one.
    high: _End | None = None
    trial = _beyond(low, hi) if start is None or start <= lo else min(start, hi)
    while len(history) < max_iterations:
        value = excess(trial)
        if -tolerance <= value <= 0 or (value > 0 and trial == hi):
            return result_at(trial, converged=True)
        if value > 0:
            low, high = _End(density=trial, value=value), None if high is None else _kept(high)
        else:
            low, high = _kept(low), _End(density=trial, value=value)
        if high is not None and high.density - low.density <= SAME_DENSITY * high.density:
            return result_at(high.density, converged=True)
        trial = _beyond(low, hi) if high is None else _between(low, high, -0.5 * tolerance)
    return result_at(low.density if high is None else high.density, converged=False)


def _kept(end: _End) -> _End:
    """The end that stays: from its second time on with half its value (Illinois)."""
    value = end.value if end.stayed == 0 else 0.5 * end.value
    return _End(density=end.density, value=value, stayed=end.stayed + 1)


def _beyond(low: _End, hi: float) -> float:
    """Density a little above the one of a power law, at most the upper bound."""
    return float(min(low.density * np.exp(low.value / EXPONENT) * BEYOND, hi))


def _between(low: _End, high: _End, aim: float) -> float:
    """Density where the line through both ends, in logarithms, has the value ``aim``."""
    a, b = np.log(low.density), np.log(high.density)
    over, under = low.value - aim, aim - high.value
    share = over / (over + under) if under > 0 and np.isfinite(under) else 0.5
    return float(np.exp(a + np.clip(share, 0.02, 0.98) * (b - a)))


def _evaluate(problem: SizingProblem, density: float, number: int, change: float) -> SizingStep:
    """Every utilisation at one density."""
    model = problem.model
    rho = np.full(model.space.element_count, density)
    state = solved_state(model, rho, problem.limits)
    return SizingStep(
        iteration=number,
        mass_g=lattice_mass(model, rho) * 1e6,
        mean_density=density,
        utilisations=tuple(
            float(limit.predict(state).value) / limit.allowed for limit in problem.limits
        ),
        change=change,
    )


def _warn_of_rises(history: Sequence[SizingStep]) -> None:
    """Log where the largest utilisation rises with density: then a lower density may hold too."""
    steps = sorted(history, key=lambda step: step.mean_density)
    for earlier, later in pairwise(steps):
        if later.utilisation > earlier.utilisation * (1 + RISE):
            log.warning(
                "uniform sizing: the largest utilisation rises from %.4g to %.4g between densities "
                "%.4g and %.4g; a density below the one found may hold too",
                earlier.utilisation, later.utilisation, earlier.mean_density, later.mean_density,
            )  # fmt: skip
            return
