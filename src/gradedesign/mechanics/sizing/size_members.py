"""Sizing of lattice with solid members: all shares of solid first, then bodies.

Shares between lattice and solid are free at first, then cost their price, and the step that makes
them is sharpened; so the members find their places before they must be all or nothing. What is left
of grey turns into the surface of bodies, whose level is moved until the most used limit is met.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.sizing.analysed_step import analysed_step
from gradedesign.mechanics.sizing.filter import cone_filter, filtered
from gradedesign.mechanics.sizing.homogenised import total_mass
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.members import LEAST_MEMBER, Members, stepped
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
)

#: Prices and sharpnesses of shares in turn, and the iterations for each. From free shares on: local
#: optima of designs that begin with a price weigh up to a fifth more. Iterations: chosen, not
#: measured.
STAGES = ((0.0, 0.0, 10), (3.0, 1.0, 8), (3.0, 4.0, 8), (3.0, 8.0, 8), (3.0, 16.0, 8))
#: Share of solid that a first design begins with.
_BEGINNING = 0.05
#: Radius of the filter of members over their least thickness: a ball of that radius lies inside a
#: member where its filtered variable is a half at the surface. Chosen, not measured.
_RADIUS = 1.25
#: Levels of the surface that are tried, and how near to its aim the most used limit is to be.
_MOST_LEVELS, _NEAR = 5, 0.004
#: First change of the level, and the largest from the first level. Chosen, not measured.
_FIRST_CHANGE, _MOST_CHANGE = 0.05, 0.4

#: ``sized(problem, start, most iterations)``: one run of sizing.
Sized = Callable[[SizingProblem, FloatArray | None, int], SizingResult]
#: ``bodied(field)``: the homogenised part with the bodies of a field of members.
Bodied = Callable[[FloatArray], HomogenisedModel]


def size_members(
    problem: SizingProblem,
    thickness: float,
    start: FloatArray | None,
    sized: Sized,
    bodied: Bodied,
    on_step: Callable[[SizingStep], None] | None = None,
) -> SizingResult:
    """The lightest lattice with solid members that holds every limit.

    Parameters
    ----------
    problem : SizingProblem
        Without members.
    thickness : float, mm
        Of the thinnest member.
    start : (n,) array, optional
        Variables of an earlier design, with which only the last stage is repeated.
    sized : callable
        ``sized(problem, start, most iterations)``.
    bodied : callable
        The homogenised part with the bodies of a field of members ``(M,)``.
    on_step : callable, optional
        Receives the analyses of bodies; those of ``sized`` it receives there.

    Returns
    -------
    SizingResult
        With the members' field of the bodies, and the history of all stages.
    """
    part = problem.model
    room = part.volumes * np.maximum(1 - part.solid_fraction, 1e-6)
    members = Members(filter=cone_filter(centroids(part.space.mesh), room, _RADIUS * thickness))
    x, history = start, list[SizingStep]()
    if x is None:
        lo, hi = problem.bounds
        x = np.concatenate(
            [
                np.full(problem.filter.shape[1], np.sqrt(lo * hi)),
                np.full(members.filter.shape[1], LEAST_MEMBER + _BEGINNING),
            ]
        )
    for price, sharpness, most in STAGES if start is None else STAGES[-1:]:
        members = replace(members, price=price, sharpness=sharpness)
        result = sized(replace(problem, members=members), x, most)
        x = result.variables
        history += result.history
    field = filtered(members.filter, x[problem.filter.shape[1] :] - LEAST_MEMBER)
    level = _level_of_volume(problem, field, stepped(members, field))
    level, step = _tuned_level(problem, bodied, result.rho, field, level, len(history), on_step)
    return replace(
        result,
        members=field + (0.5 - level),
        history=(*history, step),
        feasible=step.utilisation <= 1.0,
    )


def _tuned_level(
    problem: SizingProblem,
    bodied: Bodied,
    rho: FloatArray,
    field: FloatArray,
    level: float,
    number: int,
    on_step: Callable[[SizingStep], None] | None,
) -> tuple[float, SizingStep]:
    """Level of the field at which bodies meet the aim of the most used limit, and their step."""
    first, tried, steps = level, list[tuple[float, float]](), list[SizingStep]()
    for k in range(_MOST_LEVELS):
        step = _step_of_bodies(problem, bodied(field + (0.5 - level)), rho, number + k)
        if on_step is not None:
            on_step(step)
        steps.append(step)
        tried.append((level, float(np.log(step.utilisation / problem.target))))
        if abs(tried[-1][1]) <= _NEAR:
            break
        level = float(np.clip(_next_level(tried), first - _MOST_CHANGE, first + _MOST_CHANGE))
    best = min(range(len(steps)), key=lambda k: _rank(steps[k], problem.target))
    return tried[best][0], steps[best]


def _step_of_bodies(
    problem: SizingProblem, bodies: HomogenisedModel, rho: FloatArray, number: int
) -> SizingStep:
    """Step of the history of a design with members as bodies."""
    whole = problem.model
    part = replace(
        whole,
        solid_fraction=bodies.solid_fraction,
        solid_moments=bodies.solid_moments,
        effective=bodies.effective,
    )
    step = analysed_step(replace(problem, model=part), rho, number, 0.0)
    passive = whole.material.density * float(whole.volumes @ whole.solid_fraction)
    return replace(step, mass_g=(total_mass(part, rho) - passive) * 1e6)


def _level_of_volume(problem: SizingProblem, field: FloatArray, share: FloatArray) -> float:
    """Level above which as much volume lies as the shares hold."""
    room = problem.model.lattice_volumes
    order = np.argsort(-field)
    above = np.cumsum(room[order])
    at = int(np.searchsorted(above, float(room @ share)))
    return float(np.clip(field[order[min(at, order.size - 1)]], 0.05, 0.95))


def _next_level(tried: list[tuple[float, float]]) -> float:
    """Level at which the line through the two nearest to the aim meets it."""
    if len(tried) == 1:
        level, off = tried[0]
        # A higher level leaves less solid, and a limit is used more.
        return level - np.sign(off) * _FIRST_CHANGE
    (a, u), (b, v) = sorted(tried, key=lambda each: abs(each[1]))[:2]
    return a - u * (b - a) / (v - u) if v != u else a - np.sign(u) * _FIRST_CHANGE


def _rank(step: SizingStep, target: float) -> tuple[bool, float]:
    """Order of designs: those that hold by their mass, then the others by their use."""
    holds = step.utilisation <= target * (1 + _NEAR)
    return not holds, step.mass_g if holds else step.utilisation
