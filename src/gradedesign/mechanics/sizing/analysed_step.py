"""Densities analysed for their limits alone, without gradients."""

from __future__ import annotations

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingStep, sizing_step
from gradedesign.mechanics.sizing.state import solved_state


def analysed_step(
    problem: SizingProblem,
    rho: FloatArray,
    iteration: int,
    change: float,
    rtol: float | None = None,
) -> SizingStep:
    """History entry of densities ``(M,)``: mass and utilisation of every limit.

    ``rtol``: as for `solved_state`.
    """
    state = solved_state(problem.model, rho, problem.limits, rtol=rtol)
    limits = problem.limits
    utilisations = tuple(limit.utilisation(float(limit.predict(state).value)) for limit in limits)
    return sizing_step(problem, rho, iteration, utilisations, change)
