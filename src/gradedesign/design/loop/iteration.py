"""Iteration of the design loop: sizing, explicit analysis, and update of the corrections."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf

from gradedesign.arrays import FloatArray, locked
from gradedesign.common.system.progress import Event, Listener, ignore, report_step
from gradedesign.design.loop.analysed import Analysed, analyse_cells
from gradedesign.design.loop.design_between import Between, design_between
from gradedesign.design.loop.designed import with_design
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.design.loop.iteration_steps import (
    FIRST_SIZING_ITERATIONS,
    TARGET,
    TUNING_SIZING_ITERATIONS,
    SizingPlan,
    predict,
    size_design,
)
from gradedesign.design.loop.lesson import Lesson, Prior, learn
from gradedesign.design.resolve.cell_choice import element_bounds
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import DisconnectedError
from gradedesign.mechanics.explicit.correction import (
    Correction,
    Discrepancy,
    discrepancy_between,
    kept_share,
)
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import Factors, expected_factors
from gradedesign.mechanics.sizing.filter import DensityFilter
from gradedesign.mechanics.sizing.homogenised_model import built_density
from gradedesign.mechanics.sizing.members import MemberField
from gradedesign.mechanics.sizing.size import SizingResult, SizingStep

#: Iterations after which a miss is taken for scatter, and the most room that is left for it.
#: Chosen, not measured.
_SCATTERED_ITERATIONS, MOST_ROOM = 3, 0.08
#: A density counts as at its lower bound within this relative distance. Chosen, not measured.
AT_BOUND = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignIteration:
    """Finished iteration of the design loop: its design, its corrections and its discrepancies."""

    summary: Iteration  #: Its row of the result.
    rows: tuple[LimitRow, ...]  #: Explicit values.
    correction: Correction  #: For the next iteration.
    variables: FloatArray  #: ``(n,)``. Design variables, to start the next sizing from.
    rho: FloatArray  #: ``(M,)``. Density of every tetrahedron.
    at_lower_bound: bool
    discrepancy: Discrepancy
    #: By LimitKey. Factors of `expected_factors`, which count until an acceptance teaches them.
    expected: Factors = field(default_factory=dict)
    members: MemberField | None = None  #: Of its solid members.

    def __post_init__(self) -> None:
        object.__setattr__(self, "variables", locked(self.variables, (None,)))
        object.__setattr__(self, "rho", locked(self.rho, (None,)))


def run_iteration(
    model: DesignModel,
    previous: tuple[DesignIteration, ...],
    factors: Factors,
    density_filter: DensityFilter,
    *,
    on_step: Callable[[SizingStep], None] | None = None,
    on_event: Listener = ignore,
) -> tuple[DesignIteration, Analysed]:
    """Size with the correction so far, analyse explicitly and update the correction.

    ``factors`` are accepted over explicit values: sizing leaves that much room. ``density_filter``
    is that of `design_filter`.
    """
    began = time.perf_counter()
    correction = previous[-1].correction if previous else Correction()
    following = partial(_next_design, model, previous, factors, density_filter, on_step, on_event)
    sized, told = following()
    timing = {"sizing": time.perf_counter() - began}
    at_most = previous[-1].summary.spacing_mm if previous else inf
    meshing, whole, case = time.perf_counter(), model, model.plan.case
    model = with_design(whole, sized.rho, sized.members)
    try:
        analysed = analyse_cells(model, sized.rho, at_most=at_most, on_event=on_event)
    except DisconnectedError as error:
        if sized.members is None or sized.members.tied:
            raise
        on_event(Event(stage="explicit", message=f"{error}: members tie in what stands alone"))
        sized, told = following(tie=True)
        if sized.members is None or not sized.members.tied:
            raise
        model = with_design(whole, sized.rho, sized.members)
        analysed = analyse_cells(model, sized.rho, at_most=at_most, on_event=on_event)
    timing["explicit solve"] = analysed.result.seconds
    timing["explicit mesh"] = time.perf_counter() - meshing - analysed.result.seconds
    part, limits = model.homogenised, model.limits
    predicted = predict(part, limits, correction, sized.rho)
    report_step("learning from the explicit analysis")
    lesson = learn(
        part,
        limits,
        Prior(correction=correction, discrepancies=tuple(i.discrepancy for i in previous)),
        predicted,
        analysed.result,
        sized.rho,
    )
    told = {key: told.get(key, float(value.value)) for key, value in predicted.values.items()}
    weights = part.lattice_volumes
    summary = replace(
        compared(limits, correction, sized, told, analysed, lesson),
        number=len(previous) + 1,
        mean_density=float(weights @ built_density(part, sized.rho) / weights.sum()),
        seconds=time.perf_counter() - began,
        timing_s={name: round(value, 3) for name, value in timing.items()},
    )
    expected = expected_factors(lesson.rows, analysed.result.traction_residual)
    lower = part.member_fraction is None and (
        not case.lattice.cells
        or _touches_lower_bound(sized.rho, weights, element_bounds(model.cells)[0])
    )
    return _iteration(summary, sized, lesson, expected, at_lower_bound=lower), analysed


def _iteration(
    summary: Iteration,
    sized: SizingResult,
    lesson: Lesson,
    expected: Factors,
    *,
    at_lower_bound: bool,
) -> DesignIteration:
    """The record of an analysed design; ``at_lower_bound``: it has no members, nor more cells."""
    return DesignIteration(
        summary=summary,
        rows=lesson.rows,
        correction=lesson.correction,
        variables=sized.variables,
        rho=sized.rho,
        members=sized.members,
        at_lower_bound=at_lower_bound,
        discrepancy=lesson.discrepancy,
        expected=expected,
    )


def _next_design(
    model: DesignModel,
    previous: tuple[DesignIteration, ...],
    factors: Factors,
    density_filter: DensityFilter,
    on_step: Callable[[SizingStep], None] | None,
    on_event: Listener,
    *,
    tie: bool = False,
) -> tuple[SizingResult, Mapping[LimitKey, float]]:
    """The next design, and its expected values if they differ from the model's prediction.

    ``tie``: as in `SizingPlan`.
    """
    masses = [each.summary.mass_g for each in previous]
    between = design_between(masses, [each.rows for each in previous], factors)
    if between is not None:
        return _mixed_design(previous, between, on_event), between.values
    sized = size_design(
        with_design(model, previous[-1].rho) if previous else model,
        previous[-1].correction if previous else Correction(),
        factors,
        density_filter,
        replace(_sizing_plan(previous), tie=tie),
        on_step,
    )
    return sized, {}


def _mixed_design(
    previous: Sequence[DesignIteration], between: Between, on_event: Listener
) -> SizingResult:
    """The design between two earlier ones that enclose the limits, see `design_between`."""
    lighter, heavier, way = previous[between.lighter], previous[between.heavier], between.way
    message = (
        f"iterations {lighter.summary.number} and {heavier.summary.number} enclose the limits: "
        f"densities {way:.0%} of the way from the first to the second"
    )
    on_event(Event(stage="sizing", message=message))
    return SizingResult(
        rho=lighter.rho + way * (heavier.rho - lighter.rho),
        members=_mixed_members(lighter, heavier, way),
        variables=lighter.variables + way * (heavier.variables - lighter.variables),
        history=(),
        converged=False,
        feasible=True,
    )


def _mixed_members(
    lighter: DesignIteration, heavier: DesignIteration, way: float
) -> MemberField | None:
    """Field of members some way between those of two designs."""
    one, other = lighter.members, heavier.members
    if one is None or other is None:
        return None
    return MemberField(
        variables=one.variables + way * (other.variables - one.variables),
        radius=one.radius,
        offset=one.offset + way * (other.offset - one.offset),
        threshold=one.threshold,
        tied=one.tied or other.tied,
    )


def _sizing_plan(previous: Sequence[DesignIteration]) -> SizingPlan:
    """Settings of the next sizing, from the iterations before it."""
    number = len(previous)
    return SizingPlan(
        start=previous[-1].variables if previous else None,
        members=previous[-1].members if previous else None,
        most_iterations=(
            FIRST_SIZING_ITERATIONS[number]
            if number < len(FIRST_SIZING_ITERATIONS)
            else TUNING_SIZING_ITERATIONS
        ),
        target=aim_of(previous),
        keep=kept_share([i.discrepancy for i in previous]),
    )


def compared(
    limits: Sequence[Limit],
    correction: Correction,
    sized: SizingResult,
    predicted: Mapping[LimitKey, float],
    analysed: Analysed,
    lesson: Lesson,
) -> Iteration:
    """Predicted and explicit values of a design, without number, duration and mean density."""
    result, rows, explicit = analysed.result, lesson.rows, lesson.explicit
    discrepancies = dict(discrepancy_between(predicted, explicit, governing=None).values)
    masses, division = result.masses_g, result.solved.division
    return Iteration(
        number=0,
        lattice_mass_g=masses["lattice"],
        mass_g=sum(masses.values()),
        mean_density=0.0,
        limits=tuple(
            LimitIteration(
                key=limit.key,
                name=limit.name,
                unit=limit.unit,
                predicted=predicted[limit.key],
                explicit=explicit.get(limit.key),
                discrepancy=discrepancies.get(limit.key),
                factor=correction.factor(limit.key),
            )
            for limit in limits
        ),
        utilisation=max((row.utilisation for row in rows), default=0.0),
        passed=all(row.passed for row in rows),
        dofs=division.unknowns,
        mesh_size_mm=division.mesh_size,
        spacing_mm=division.requested,
        seconds=0.0,
        stiffness_factor=correction.stiffness,
        sizing_iterations=len(sized.history),
        sizing_converged=sized.converged,
        timing_s={},
    )


def _touches_lower_bound(rho: FloatArray, weights: FloatArray, low: FloatArray) -> bool:
    """Whether every density where there is lattice, by volumes ``(M,)``, is at its lower bound."""
    return bool((rho <= low * (1 + AT_BOUND))[weights > 0].all())


def aim_of(previous: Sequence[DesignIteration]) -> float:
    """Utilisation of the limits that the next sizing aims at.

    `TARGET`; after three iterations whose last one breaks a limit, less by the error of its
    prediction: designs of one mass then scatter by as much, and iterations that aim at the limit
    miss it again.
    """
    if len(previous) < _SCATTERED_ITERATIONS or previous[-1].summary.passed:
        return TARGET
    discrepancy = previous[-1].discrepancy
    others = max((abs(value) for _, value in discrepancy.values), default=0.0)
    off = others if discrepancy.governing is None else abs(discrepancy.of(discrepancy.governing))
    return TARGET * (1.0 - min(off, MOST_ROOM))
