"""A design that stays below its aim, lowered to it: all densities by one factor.

Where a limit gained nothing, sizing raised all densities, and a step of the optimality criterion
came on top: the design that holds may then use its most used limit several per cent less than the
aim. Explicit analyses and acceptance would be spent on a heavier design than needed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.sizing.analysed_step import analysed_step
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingStep, element_densities

#: A most used limit that stands below the aim by more than this share is worth lowering. Chosen,
#: not measured.
SPARE = 0.005
#: Analyses at most. Chosen, not measured.
ANALYSES = 3
#: Power of one over density with which utilisation grows, until it was seen: a large one takes
#: small steps. Laws of bending-dominated cells have 2.
EXPONENT = 2.0


def lowered(
    problem: SizingProblem,
    x: FloatArray,
    step: SizingStep,
    least: FloatArray,
    most_used: float,
    on_step: Callable[[SizingStep], None] | None = None,
) -> tuple[FloatArray, tuple[SizingStep, ...]]:
    """Variables lowered together until the most used limit stands at its aim.

    Parameters
    ----------
    x : (n,) array
        Design variables that hold every limit.
    step : SizingStep
        Of x.
    least : (n,) array
        Variables that are not lowered below these.
    most_used : float
        Utilisation that is accepted at most, the aim or a little more.
    on_step : callable, optional

    Returns
    -------
    x : (n,) array
        The lightest that holds, the given one where none other does.
    steps : tuple of SizingStep
        That of x; none where x is the given one. ``on_step`` hears of refused ones too.
    """
    factor, exponent, best = 1.0, EXPONENT, (x, step)
    for number in range(1, ANALYSES + 1):
        used = best[1].utilisation
        if not 0.0 < used < (1.0 - SPARE) * problem.target:
            break
        smaller = factor * (used / problem.target) ** (1.0 / exponent)
        trial = np.maximum(smaller * x, np.minimum(least, x))
        if np.array_equal(trial, best[0]):
            break
        change = float(np.abs(trial - best[0]).max() / problem.bounds[1])
        rho = element_densities(problem, trial)
        lower_step = analysed_step(problem, rho, step.iteration + number, change)
        if on_step is not None:
            on_step(lower_step)
        grown = np.log(lower_step.utilisation / used) / np.log(factor / smaller)
        exponent = float(np.clip(grown, 0.5 * EXPONENT, 4.0 * EXPONENT))
        if lower_step.utilisation <= most_used and lower_step.mass_g < best[1].mass_g:
            factor, best = smaller, (trial, lower_step)
    return best[0], () if best[1] is step else (best[1],)
