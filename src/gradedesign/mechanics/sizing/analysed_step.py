"""Densities analysed for their limits alone, without gradients."""

from __future__ import annotations

from gradedesign.arrays import FloatArray
from gradedesign.mechanics.sizing.problem import SizingProblem, SizingStep, sizing_step
from gradedesign.mechanics.sizing.state import solved_state


def analysed_step(
    problem: SizingProblem, rho: FloatArray, iteration: int, change: float
) -> SizingStep:
    """History entry of densities ``(M,)``: mass and utilisation of every limit."""
    state = solved_state(problem.model, rho, problem.limits)
    values = ((float(limit.predict(state).value), limit.allowed) for limit in problem.limits)
    utilisations = tuple(value / allowed for value, allowed in values)
    return sizing_step(problem, rho, iteration, utilisations, change)
