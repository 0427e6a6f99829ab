"""The lightest of a family of designs, one for each mean density: a uniform lattice, or a map.

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

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import stepping
from gradedesign.mechanics.sizing.analysed_step import analysed_step
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingResult, SizingStep

log = logging.getLogger(__name__)

#: Utilisation falls about as this power of density; only the first steps of the search rest on it.
#: Chosen, not measured.
_EXPONENT = 1.5
#: A step beyond the density that `_EXPONENT` predicts, so that it lands on the other side.
BEYOND = 1.03
#: Relative width of the density interval at which the search ends where a utilisation jumps.
#: Chosen, not measured.
SAME_DENSITY = 1e-5
#: A utilisation that grows with density by more than this share is no rounding of the solver.
_RISE = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class _End:
    """End of the bracket: density, logarithm of utilisation over target, iterations it stayed."""

    density: float
    value: float
    stayed: int = 0


def size_by_mean_density(
    problem: SizingProblem,
    densities: Callable[[float], FloatArray],
    bounds: tuple[float, float],
    *,
    start: float | None = None,
    max_iterations: int = 60,
    tolerance: float = 0.004,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """Least mean density of a family at which no limit is used to more than the target.

    Returns SizingResult: its one variable is the mean density.

    - ``problem``: its filter and bounds are not looked at
    - ``densities``: mean density of the lattice to the densities ``(M,)`` of the design, none of
      which falls where the mean grows
    - ``bounds``: least and greatest mean
    - ``start``: mean density at which to look after the lower bound, such as that of an earlier
      iteration
    - ``max_iterations``: analyses at most; when they run out the least density that is known to
      hold is returned, else the last
    - ``tolerance``: the most used limit is used to between ``1 - tolerance`` and 1 of the target,
      unless the lower bound holds or the upper one does not

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
    lo, hi = bounds
    tried: list[float] = []
    history: list[SizingStep] = []

    def excess(density: float) -> float:
        """Logarithm of the largest utilisation over the target; -inf where nothing is used."""
        change = abs(density - tried[-1]) / hi if tried else 0.0
        number = len(history)
        with stepping(f"design {number + 1} of {max_iterations} at most, mean {density:.3f}"):
            step = analysed_step(problem, densities(density), number, change)
        tried.append(density)
        history.append(step)
        if on_step is not None:
            on_step(step)
        with np.errstate(divide="ignore"):
            return float(np.log(step.utilisation / problem.target))

    def result_at(density: float, *, converged: bool) -> SizingResult:
        if tried[-1] != density:
            excess(density)
        _warn_of_rises(history)
        log.info("sizing ended after %d analyses, converged=%s", len(history), converged)
        return SizingResult(
            rho=densities(density),
            variables=np.array([density]),
            history=tuple(history),
            converged=converged,
            feasible=history[-1].utilisation <= 1.0,
        )

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
    return float(min(low.density * np.exp(low.value / _EXPONENT) * BEYOND, hi))


def _between(low: _End, high: _End, aim: float) -> float:
    """Density where the line through both ends, in logarithms, has the value ``aim``."""
    a, b = np.log(low.density), np.log(high.density)
    over, under = low.value - aim, aim - high.value
    share = over / (over + under) if under > 0 and np.isfinite(under) else 0.5
    return float(np.exp(a + np.clip(share, 0.02, 0.98) * (b - a)))


def _warn_of_rises(history: Sequence[SizingStep]) -> None:
    """Log where the largest utilisation rises with density: then a lower density may hold too."""
    steps = sorted(history, key=lambda step: step.mean_density)
    for earlier, later in pairwise(steps):
        if later.utilisation > earlier.utilisation * (1 + _RISE):
            log.warning(
                "the largest utilisation rises from %.4g to %.4g between densities "
                "%.4g and %.4g; a density below the one found may hold too",
                earlier.utilisation, later.utilisation, earlier.mean_density, later.mean_density,
            )  # fmt: skip
            return
