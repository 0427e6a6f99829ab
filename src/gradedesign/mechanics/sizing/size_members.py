"""Sizing of lattice with solid members: all shares of solid first, then bodies.

Shares between lattice and solid are free at first, then cost their price, and the step that makes
them is sharpened; so the members find their places before they must be all or nothing. What is left
of grey becomes bodies, whose surface is moved until the most used limit is met.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.progress import counted
from gradedesign.mechanics.sizing.analysed_step import analysed_step
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel, effective_density
from gradedesign.mechanics.sizing.members import (
    HALF,
    LEAST_MEMBER,
    MemberField,
    Members,
    allowed_points,
    mean_share,
    member_filter,
    member_shares,
    with_moments,
)
from gradedesign.mechanics.sizing.problem import (
    SizingProblem,
    SizingResult,
    SizingStep,
    density_variables,
    element_shares,
    member_variables,
)
from gradedesign.mechanics.sizing.size import INSISTENCE, TOLERANCE
from gradedesign.mechanics.sizing.tied_members import tied

#: Prices and sharpnesses of shares in turn, and the iterations for each. From free shares on: local
#: optima of designs that begin with a price weigh up to a fifth more. Up to 64, where shares are
#: bodies: the shares of `bracket` at 16 were a third stiffer than bodies of their volume, which had
#: to weigh 35 g more. With 8, 6, 6, 6, 8, 8 and 8 iterations the same designs came out, to 0.1 % of
#: mass: `bracket` and `mini`, with cells and without. Only designs that are somebody's result
#: insist on their limits, the last ones and rough ones: where all did, `mini` took 50 instead
#: of 40 iterations, to 5.03 instead of 5.02 g.
STAGES = (
    *((0.0, 0.0, 5), (3.0, 2.0, 4), (3.0, 4.0, 4), (3.0, 8.0, 4)),
    *((3.0, 16.0, 5), (3.0, 32.0, 5), (3.0, 64.0, 8)),
)
#: Stages without bodies: their shares weigh less than bodies do, 166 instead of 178 g in `bracket`.
_ROUGH = STAGES[:4]
#: Share of solid that a first design begins with, and where cells carry next to nothing, so that it
#: must not begin far beyond its limits. Chosen, not measured.
_BEGINNING, _BEGINNING_ALONE = 0.05, 0.3
#: First of the stages that are repeated with members that carry from a higher threshold on, that
#: threshold, and how much more than their shares bodies weigh then: filtered variables that hardly
#: pass a half carry at single Gauss points, which no body follows. `cantilever-compact` in solid
#: and void, members of 10 mm: 43 g of shares are 86 g of bodies that use 4.3 times the limit, 125 g
#: where they hold it; with the threshold both weigh 54 g. `mini` with 3 mm: 1.98 instead of 2.36 g.
#: Where bodies are as heavy as shares it costs: `mbb-beam` 211 instead of 199 g. Rough shares of
#: solid and void have the threshold too: 217, 3.75 and 85 g of `mbb-beam`, `mini` and
#: `cantilever-compact`, accepted with 206, 3.80 and 97 g, are 194, 3.56 and 73 g at a half.
_REPEATED, _THRESHOLD, _HEAVIER = 3, 0.6, 1.05
#: Radius of the filter of members over their least thickness: a ball of that radius lies inside a
#: member where its filtered variable is a half at the surface. Chosen, not measured.
_RADIUS = 1.25
#: Offsets of the surface that are tried, and how near to its aim the most used limit is to be.
#: Chosen, not measured.
_MOST_OFFSETS, _NEAR = 5, 0.004
#: Residual over the loads for these offsets: uses of limits to a hundredth of `_NEAR`.
_RTOL = 1e-4
#: Tolerance of a design whose bodies' surface is moved until they meet the aim: with that of other
#: designs, 0.004, `bracket` with cells took 15 instead of 8 iterations at the last sharpness.
_MOVABLE = 0.02
#: Variable to which members carry as much as before. Chosen, not measured.
_SAME = 1e-6
#: Largest offset over the least thickness: twice of it is half of the thinnest. Chosen, not
#: measured.
_MOST_OFFSET = 0.25

#: ``sized(problem, start, most iterations, insistence, tolerance)``: one run of sizing.
Sized = Callable[[SizingProblem, FloatArray | None, int, int, float], SizingResult]
#: Price, sharpness and iterations of one of `STAGES`.
Stage = tuple[float, float, int]
#: ``bodied(field)(offset)``: the homogenised part with the bodies of a field of members, whose
#: surface is moved outward by so many mm.
Bodied = Callable[[MemberField], Callable[[float], HomogenisedModel]]


def member_iterations(*, first: bool, cells: bool) -> int:
    """Iterations of a sizing with members: of the first one of a run, or of later ones.

    Without ``cells`` the stages with a higher threshold are taken to follow.
    """
    stages = STAGES[-1:] if not first else STAGES if cells else STAGES + STAGES[_REPEATED:]
    return sum(most for _, _, most in stages)


def size_members(
    problem: SizingProblem,
    thickness: float,
    earlier: tuple[FloatArray, MemberField] | None,
    sized: Sized,
    bodied: Bodied | None,
    on_step: Callable[[SizingStep], None] | None = None,
    *,
    weight: Field | None = None,
    tie: bool = False,
) -> SizingResult:
    """The lightest lattice with solid members that holds every limit.

    Returns SizingResult: with the members' field of the bodies, and the history of all stages.

    - ``problem``: without members
    - ``thickness``, mm: of the thinnest member
    - ``earlier``: variables ``(n,)`` of an earlier design, with which only the last stages are
      repeated, and its members, whose threshold they have
    - ``bodied``: the homogenised part with the bodies of a field of members; None: rough shares are
      the result
    - ``on_step``: receives the analyses of bodies; those of ``sized`` it receives there
    - ``weight``: points ``(3, m)`` mm to ``(m,)``, at least a half where members may be; None:
      everywhere
    - ``tie``: whether bodies tie in what is solid in any case: neither cells nor a skin do
    """
    problem = replace(problem, model=with_moments(problem.model))
    part, radius = problem.model, _RADIUS * thickness
    lo, hi = problem.bounds
    held = float(effective_density(part, np.full(part.volumes.size, hi)).max())
    with_cells = held > LEAST_MEMBER
    rough = bodied is None and not with_cells
    threshold = earlier[1].threshold if earlier is not None else _THRESHOLD if rough else HALF
    members = Members(
        filter=member_filter(part, radius),
        radius=radius,
        threshold=threshold,
        allowed=None if weight is None else allowed_points(part.space, weight),
    )
    share = _BEGINNING if with_cells else _BEGINNING_ALONE
    counts = problem.filter.shape[1], members.filter.shape[1]
    x = np.repeat([np.sqrt(lo * hi), LEAST_MEMBER + share], counts)
    stages = STAGES if earlier is None else _later_stages(earlier[1], thickness)
    if bodied is None:
        stages = _ROUGH
    results = _staged(
        problem, members, x if earlier is None else earlier[0], stages, sized, with_cells=with_cells
    )
    history = [step for result in results for step in result.history]
    result = results[-1]
    if result.members is None or bodied is None:
        return replace(result, history=tuple(history))

    def bodies(result: SizingResult, field: MemberField) -> SizingResult:
        if tie:
            field = tied(part, members, field, thickness)
        found, step = _moved(problem, bodied, result, field, thickness, len(history), on_step)
        history.append(step)
        return replace(result, members=found, feasible=step.utilisation <= 1.0)

    shares = history[-1]
    first = bodies(result, result.members)
    best = history[-1]
    if earlier is not None or with_cells or best.mass_g <= _HEAVIER * shares.mass_g:
        return replace(first, history=tuple(history))
    again = _carried_again(problem, members, results[_REPEATED - 1].variables, sized)
    history += [step for result in again for step in result.history]
    second = bodies(again[-1], again[-1].members or result.members)
    aim = _aim(problem)
    if _rank(best, aim) < _rank(history[-1], aim):
        return replace(first, history=(*history, best))
    return replace(second, history=tuple(history))


def _later_stages(earlier: MemberField, thickness: float) -> Sequence[Stage]:
    """Stages that a later design repeats: the last one, which moves members little.

    More where the surface of the bodies was moved as far as it may be: by less or more of that
    alone they cannot meet their limits.
    """
    at_bound = abs(earlier.offset) >= (1.0 - _NEAR) * _MOST_OFFSET * thickness
    return STAGES[_REPEATED:] if at_bound else STAGES[-1:]


def _staged(
    problem: SizingProblem,
    members: Members,
    x: FloatArray,
    stages: Sequence[Stage],
    sized: Sized,
    before: SizingProblem | None = None,
    *,
    with_cells: bool = False,
) -> list[SizingResult]:
    """Results of stages of sizing, each from the variables of the one before.

    ``before``: problem of the variables ``(n,)`` to begin with, where they are those of members.
    """
    results: list[SizingResult] = []
    for stage in counted(stages, "members, stage", len(stages)):
        price, sharpness, most = stage
        own = replace(problem, members=replace(members, price=price, sharpness=sharpness))
        if before is not None and not with_cells:
            x = _as_much(before, own, x)
        before = own
        insistence = INSISTENCE if stage in (_ROUGH[-1], STAGES[-1]) else 1
        tolerance = _MOVABLE if stage == STAGES[-1] else TOLERANCE
        results.append(sized(own, x, most, insistence, tolerance))
        x = results[-1].variables
    return results


def _carried_again(
    problem: SizingProblem, members: Members, x: FloatArray, sized: Sized
) -> list[SizingResult]:
    """Results of stages that are repeated with members that carry from a higher threshold on.

    ``x (n,)``: variables of the stage before those.
    """
    price, sharpness, _ = STAGES[_REPEATED - 1]
    before = replace(problem, members=replace(members, price=price, sharpness=sharpness))
    eroded = replace(members, threshold=_THRESHOLD)
    return _staged(problem, eroded, x, STAGES[_REPEATED:], sized, before)


def _as_much(before: SizingProblem, now: SizingProblem, x: FloatArray) -> FloatArray:
    """Design variables ``(n,)`` whose members carry as much volume as before, by one more for all.

    A sharper step, or one at a higher threshold, would else begin with members that are lost where
    they are thin (Xu, Cai, Cheng, Struct. Multidisc. Optim. 41, 2010, keep the volume alike).
    """
    volumes, members, b = now.model.lattice_volumes, now.members, member_variables(now, x)
    shares = element_shares(before, x)
    if shares is None or members is None:
        raise ValueError("there are no members before or now")
    aim = float(volumes @ mean_share(shares))

    def missing(more: float) -> float:
        return float(volumes @ mean_share(member_shares(members, np.minimum(b + more, 1.0)))) - aim

    if missing(0.0) >= 0.0:
        return x
    more = brentq(missing, 0.0, 1.0, xtol=_SAME)
    return np.concatenate([density_variables(now, x), LEAST_MEMBER + np.minimum(b + more, 1.0)])


def _moved(
    problem: SizingProblem,
    bodied: Bodied,
    result: SizingResult,
    members: MemberField,
    thickness: float,
    number: int,
    on_step: Callable[[SizingStep], None] | None,
) -> tuple[MemberField, SizingStep]:
    """The members with the offset at which their bodies meet the aim of the most used limit."""
    aim = _aim(problem)
    tried: list[tuple[MemberField, SizingStep]] = []
    offsets, off, moved = [0.0], list[float](), bodied(members)
    for k in range(_MOST_OFFSETS):
        field = replace(members, offset=offsets[-1])
        step = _step_of_bodies(problem, moved(offsets[-1]), result.rho, number + k)
        if on_step is not None:
            on_step(step)
        tried.append((field, step))
        off.append(float(np.log(step.utilisation / aim)))
        if abs(off[-1]) <= _NEAR:
            break
        offsets.append(_next_offset(offsets, off, thickness))
    return min(tried, key=lambda each: _rank(each[1], aim))


def _aim(problem: SizingProblem) -> float:
    """Utilisation that bodies aim at: as near to it as is asked for they hold their limits."""
    return min(problem.target, 1.0 / (1.0 + _NEAR))


def _step_of_bodies(
    problem: SizingProblem, bodies: HomogenisedModel, rho: FloatArray, number: int
) -> SizingStep:
    """Step of the history of a design with members as bodies."""
    whole = problem.model
    part = replace(
        whole,
        solid_fraction=bodies.solid_fraction,
        solid_moments=bodies.solid_moments,
        member_fraction=bodies.member_fraction,
        effective=bodies.effective,
    )
    step = analysed_step(replace(problem, model=part), rho, number, 0.0, _RTOL)
    added = float(whole.volumes @ (part.solid_fraction - whole.solid_fraction))
    members = whole.material.density * added * 1e6
    return replace(step, mass_g=step.mass_g + members, members_g=members)


def _next_offset(offsets: list[float], off: list[float], thickness: float) -> float:
    """Offset at which the line through the two nearest to the aim meets it, within bounds.

    ``off`` are logarithms of use over its aim. Where they tell no slope it is that of a member
    under tension, whose stiffness grows as its thickness does, by two offsets.
    """
    most = _MOST_OFFSET * thickness
    near = np.argsort(np.abs(off))[:2]
    a, u, slope = offsets[near[0]], off[near[0]], -2.0 / thickness
    if len(near) == 2 and (b := offsets[near[1]]) != a:
        found = (off[near[1]] - u) / (b - a)
        slope = found if found < 0 else slope
    return float(np.clip(a - u / slope, -most, most))


def _rank(step: SizingStep, target: float) -> tuple[bool, float]:
    """Order of designs: those that hold by their mass, then the others by their use."""
    holds = step.utilisation <= target * (1 + _NEAR)
    return not holds, step.mass_g if holds else step.utilisation
