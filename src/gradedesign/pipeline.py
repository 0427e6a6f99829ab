"""The multi-fidelity loop: from a case to the lightest lattice found that meets its limits.

Read this first. Part, solid analysis; then iterations of sizing on the homogenised part, explicit
analysis and correction; then acceptance: the exported surface, meshed again whole, decides, or its
most stressed submodels correct the stress of the explicit analysis; a miss iterates again. Where
the case states the density of its lattice, nothing is sought: part, lattice, print checks. Above
300 lines: every stage of both ways in one place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import cache, partial
from pathlib import Path

from gradedesign.common.system.limits import Deadline
from gradedesign.common.system.progress import Listener, ignore
from gradedesign.design.case.schema import Case
from gradedesign.design.check.lighter_phases import lighter_phases
from gradedesign.design.check.price import PricedBody, price_of_lattice, why_lattice
from gradedesign.design.loop.accepted import Accepted, accept_design, judge_stress
from gradedesign.design.loop.accepted_rows import best_rows
from gradedesign.design.loop.analysed import Analysed, analyse_cells
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.bodies import variant_spreads
from gradedesign.design.loop.designed import with_design
from gradedesign.design.loop.ended import why_ended
from gradedesign.design.loop.exported_surface import export_surface
from gradedesign.design.loop.iteration import DesignIteration, run_iteration
from gradedesign.design.loop.iteration_steps import SizingPlan, design_filter, size_design
from gradedesign.design.loop.loop import Progress, run_loop
from gradedesign.design.loop.loop_stages import Stages
from gradedesign.design.loop.run_cost import RunCost, no_time_for_more
from gradedesign.design.loop.stated_print import stated_print
from gradedesign.design.resolve.design_model import DesignModel, prepare
from gradedesign.design.resolve.fitting_part import fitting_part
from gradedesign.design.resolve.lattice_files import STL_NAME, outer_records
from gradedesign.design.resolve.oriented import oriented
from gradedesign.design.resolve.own_cell import with_own_cell
from gradedesign.design.resolve.registry import Registry
from gradedesign.design.resolve.size_effects import with_size_effects
from gradedesign.design.resolve.solid import solve_solid, with_solid
from gradedesign.design.resolve.stated_lattice import stated_lattice
from gradedesign.design.verdict.as_built import with_as_built
from gradedesign.design.verdict.computed import Computed
from gradedesign.design.verdict.printable import with_print_limits
from gradedesign.design.verdict.result import RunResult
from gradedesign.design.verdict.shown import Shown, shown_of
from gradedesign.design.verdict.stated_result import stated_result
from gradedesign.design.verdict.summary import (
    best_iteration,
    infeasible_result,
    partial_result,
    verdict_result,
)
from gradedesign.errors import CaseError
from gradedesign.geometry.lattice.density_source import DensitySource
from gradedesign.geometry.lattice.lattice_schema import PHASES
from gradedesign.mechanics.explicit.correction import Correction
from gradedesign.mechanics.explicit.yielding import yielding_words
from gradedesign.mechanics.limits.limit import limits_stress
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import Factors, solid_breaks, unsure_words
from gradedesign.program.host.registry import build_registry
from gradedesign.program.outputs.failed import recording_failure
from gradedesign.program.outputs.files import write_outputs, write_stated
from gradedesign.program.outputs.finished import finished_result
from gradedesign.program.outputs.printed_files import write_printed, written_back
from gradedesign.program.store.run_folder import RunFolder
from gradedesign.program.store.stages import (
    begun_budget,
    default_folder,
    design_key,
    load_acceptance,
    load_iterations,
    open_stages,
    save_acceptance,
    save_iteration,
)

#: Utilisation that sizing aims at when no explicit analysis follows it. Chosen, not measured.
_FULL_UTILISATION = 0.998


def run(
    case: Case,
    registry: Registry | None = None,
    *,
    folder: Path | None = None,
    on_event: Listener = ignore,
    resume: bool = False,
    overwrite: bool = False,
    density: DensitySource | None = None,
) -> RunResult:
    """Run the whole loop on a case, or build its lattice where its density is stated.

    Parameters
    ----------
    case : Case
        From `load_case`.
    registry : Registry, optional
        Cells, laws, materials and formats; the installed ones by default.
    folder : Path, optional
        Run folder; ``runs/<case name>`` below the working folder by default.
    on_event : callable, optional
        Receives every progress event.
    resume : bool
        Go on from the last finished stage of a run that was interrupted, failed, or was ended by
        time or iterations of which there are more now; a finished one returns its result at once.
    overwrite : bool
        Replace the results of an earlier run.
    density : callable, optional
        Points ``(3, n)`` mm to relative density ``(n,)``, in place of a density that the case
        states.

    Returns
    -------
    RunResult
        Also written to ``result.json``. ``not_met`` and ``infeasible`` are results.

    Raises
    ------
    GradeDesignError
        Whatever stopped the run, by name; ``result.json`` then says ``failed``.

    Examples
    --------
    >>> from gradedesign import load_case
    >>> case = load_case("cases/mini")  # its run takes about a minute, so no test runs it
    >>> result = run(case, overwrite=True)  # doctest: +SKIP
    >>> result.status, round(result.mass_g, 1)  # doctest: +SKIP
    ('met', 8.4)
    """
    if density is not None and not case.lattice.stated:
        raise CaseError(
            f"{case.where('lattice.density')}: density=... takes the place of a stated density, "
            f"and the case has its density found; expected e.g. density = 0.3 in [lattice]"
        )
    registry = build_registry() if registry is None else registry
    target = default_folder(case.name) if folder is None else folder
    with open_stages(target, case.case_hash, resume=resume, overwrite=overwrite) as out:
        announce = Announcer(on_event)
        done = finished_result(out, case.run) if resume and density is None else None
        if done is not None:
            announce.say("resume", f"{out.path} holds the result of this case; nothing is run")
            return done
        with recording_failure(out, case, registry, announce.timing, announce.finished):
            registry = with_own_cell(case.lattice, registry, case.where)
            if case.lattice.stated:
                return _build_stated(case, registry, out, announce, density)
            return _run_stages(case, registry, out, announce)


def _build_stated(
    case: Case,
    registry: Registry,
    out: RunFolder,
    announce: Announcer,
    density: DensitySource | None,
) -> RunResult:
    """Build the lattice of a stated density, measure what is printed of it, and write it."""
    with announce.stage("part"):
        case, part = fitting_part(case, registry)
    with announce.stage("density"):
        stated = stated_lattice(case, registry, part, density)
    with announce.stage("lattice"):
        made = stated_print(stated)
    result = stated_result(registry, stated, made)
    announce.say("lattice", made.words)
    if joints := result.measures["joints_mm3"]:
        announce.say("lattice", f"joints add {joints:.4g} mm^3")
    return write_stated((out, registry, announce), stated, made, result)


def _run_stages(case: Case, registry: Registry, out: RunFolder, announce: Announcer) -> RunResult:
    """Run the stages in order and write the result."""
    cost = RunCost(budget=case.run)
    model = _solved(case, registry, out, announce)
    announce.limits("solid", model.solid)
    announce.warnings((*model.solid_yields, *unsure_words(model.solid)))
    if solid_breaks(model.solid):
        result = infeasible_result(model, registry)
        return write_outputs(out, model, registry, result, announce, Computed())
    if case.run.stop_after == "solid":
        result = partial_result(model, registry, "solid")
        return write_outputs(out, model, registry, result, announce, Computed())
    model = with_size_effects(oriented(model), announce.listener)
    bodies: tuple[PricedBody, ...] = ()
    if case.lattice.any_phase:
        resolved = model.plan.case
        lattice = resolved.lattice.model_copy(update={"phases": PHASES[:2]})
        filled = resolved.model_copy(update={"lattice": lattice})
        filled_model = replace(model, plan=replace(model.plan, case=filled))
        void = case.model_copy(update={"lattice": lattice.without_cells()})
        other = with_own_cell(void.lattice, registry, case.where)
        made: dict[tuple[str, ...], Callable[[], DesignModel]] = {
            PHASES[:2]: lambda: filled_model,
            PHASES[1:]: partial(_solved, void, other, out, announce),
        }
        with announce.stage("phases"):
            model, bodies, words = lighter_phases(made)
        announce.say("phases", words)
        registry = registry if bodies[0].asked else other
    if case.run.stop_after in ("sizing", "lattice"):
        return _stop_early(model, registry, out, announce)
    cost.predict(model, announce)
    return loop(model, registry, out, announce, cost, bodies)


def _solved(case: Case, registry: Registry, out: RunFolder, announce: Announcer) -> DesignModel:
    """The part of a case, prepared and analysed as a solid."""
    with announce.stage("part"):
        # By more time, with which a run is resumed, the lower density would fall: iterations that
        # are finished would be of another lattice than the ones to come.
        begun = begun_budget(out, case.case_hash, case.run)
        model = prepare(case.model_copy(update={"run": begun}), registry, announce.listener)
        resolved = model.plan.case
        given = {name: getattr(case.run, name) for name in ("memory", "time")}
        now = resolved.model_copy(update={"run": resolved.run.model_copy(update=given)})
        model = replace(model, plan=replace(model.plan, case=now))
    announce.part(model)
    with announce.stage("solid"):
        return with_solid(model, solve_solid(model.homogenised))


def _stop_early(
    model: DesignModel, registry: Registry, out: RunFolder, announce: Announcer
) -> RunResult:
    """Size once, and stop there or after building the lattice."""
    case = model.plan.case
    with announce.stage("sizing"):
        sized = size_design(
            model,
            Correction(),
            {},
            design_filter(model),
            SizingPlan(target=_FULL_UTILISATION, most_iterations=60),
            announce.sizing_step,
        )
    designed = with_design(model, sized.rho, sized.members)
    result = partial_result(designed, registry, case.run.stop_after, sized=sized)
    computed = Computed(rho=sized.rho, members=sized.members)
    return write_outputs(out, model, registry, result, announce, computed)


def loop(
    model: DesignModel,
    registry: Registry,
    out: RunFolder,
    announce: Announcer,
    cost: RunCost,
    bodies: tuple[PricedBody, ...] = (),
) -> RunResult:
    """Run the loop on a prepared part, from where an earlier run stopped, and write the verdict.

    ``bodies``: those that were sized to choose between them.
    """
    plan, case, key = model.plan, model.plan.case, design_key(model)
    begun_budget(out, case.case_hash, case.run, begins=True)
    iterations = load_iterations(out, key)
    for iteration in iterations:
        announce.iteration(iteration, resumed=True)
    refused, factors, last = load_acceptance(out, key, len(iterations))
    deadline = cost.deadline(iterations)
    outcome = run_loop(
        loop_stages(model, out, announce, cost, deadline),
        Progress(iterations=iterations, refused=refused, factors=factors, last=last),
    )
    shown = shown_design(model, out, announce, outcome.iterations, outcome.accepted)
    announce.printed(shown.printed, plan.material)
    result = verdict_result(
        model, registry, outcome.iterations, outcome.accepted, outcome.ended, shown
    )
    result = with_as_built(result, plan.process, plan.material, shown, outcome.accepted)
    result = with_print_limits(result, case.print, shown.printability)
    if case.run.price and (case.lattice.cells or not bodies):
        sized = {body.name: body for body in bodies if not body.asked}
        bodies = _priced(partial(price_of_lattice, model), out, key, announce, deadline)
        bodies = tuple(sized.get(body.name, body) for body in bodies)
    result = replace(result, predicted=cost.data(), bodies=bodies, why_lattice=why_lattice(bodies))
    computed = Computed(shown=shown, iterations=outcome.iterations)
    return write_outputs(out, model, registry, result, announce, computed)


def _priced(
    price: Callable[[Callable[[], str]], tuple[PricedBody, ...]],
    out: RunFolder,
    key: str,
    announce: Announcer,
    deadline: Deadline,
) -> tuple[PricedBody, ...]:
    """Other bodies at the same limits; what an interrupted run has sized is not sized again."""
    stored = out.load_stage("price", key)
    if stored is not None:
        return tuple(PricedBody(**body) for body in stored[1]["bodies"])
    why_not = partial(no_time_for_more, deadline, deadline.elapsed())
    with announce.stage("price"):
        bodies = price(why_not)
    if not why_not():
        out.save_stage("price", key, {}, {"bodies": [asdict(body) for body in bodies]})
    return bodies


def loop_stages(
    model: DesignModel,
    out: RunFolder,
    announce: Announcer,
    cost: RunCost,
    deadline: Deadline,
) -> Stages:
    """Stages of the loop for a prepared part."""
    key, case = design_key(model), model.plan.case
    matrix = cache(lambda: design_filter(model))
    limited = limits_stress(model.limits)

    def iterate(
        previous: tuple[DesignIteration, ...], factors: Factors
    ) -> tuple[DesignIteration, Analysed]:
        number, most = len(previous) + 1, case.run.max_iterations
        with announce.stage("iteration", f"{number} of {most} at most"):
            iteration, analysed = run_iteration(
                model,
                previous,
                factors,
                matrix(),
                on_step=announce.sizing_step,
                on_event=announce.listener,
            )
        announce.warnings(yielding_words(analysed.result.yields, "the lattice", limited=limited))
        return iteration, analysed

    def accept(iteration: DesignIteration, analysed: Analysed | None) -> Accepted:
        cost.begin_acceptance(iteration, deadline, announce)
        return cost.timed(lambda: judge(model, out, announce, iteration, analysed))

    def judge_postponed(accepted: Accepted) -> Accepted:
        with announce.stage("acceptance"):
            accepted = judge_stress(model.limits, case.run, accepted, announce)
        announce.limits("acceptance", accepted.rows)
        return accepted

    def store_iteration(finished: tuple[DesignIteration, ...]) -> None:
        save_iteration(out, key, finished[-1])
        announce.iteration(finished[-1])
        cost.learn(finished, announce)

    return Stages(
        iterate=iterate,
        accept=accept,
        judge_stress=judge_postponed,
        why_ended=lambda finished, factors: why_ended(
            model, finished, factors, deadline, cost.reserved(finished)
        ),
        store_iteration=store_iteration,
        store_acceptance=lambda *judged: save_acceptance(out, key, *judged),
    )


def shown_design(
    model: DesignModel,
    out: RunFolder,
    announce: Announcer,
    iterations: Sequence[DesignIteration],
    accepted: Accepted | None,
) -> Shown:
    """The judged design, or the best that was found, whose surface is then exported.

    Raises
    ------
    ResourceError
        If the file of the judged design is no longer the one that was judged.
    """
    if accepted is not None:
        if out.artefacts()[STL_NAME].sha256 != accepted.sha256:
            # A later design was written there and refused, or is heavier.
            case, part = model.plan.case, model.plan.part.surface
            outer = outer_records(case.print, case.part.file, part)
            write_printed(out, accepted.surface, outer)
        out.read_bytes(STL_NAME)
        design, analysed, surface = accepted.iteration, accepted.analysed, accepted.surface
        rows, remeshed = tuple[LimitRow, ...](), accepted.acceptance.whole
        built = accepted.bodies.built
    else:
        design, remeshed, built = best_iteration(iterations), None, None
        with announce.stage("explicit"):
            model = with_design(model, design.rho, design.members)
            analysed = analyse_cells(model, design.rho, on_event=announce.listener)
            surface, _, _ = export_surface(model.plan, partial(written_back, out), analysed)
            rows = best_rows(
                model.limits, model.plan.tools.analysis, design, analysed, announce.listener
            )
        announce.limits("explicit", rows)
    with announce.stage("printed"):
        shown = shown_of(model.plan, design, analysed, surface, rows, remeshed, built)
    process = model.plan.process
    if accepted is None or process is None or not process.variants:
        return shown
    with announce.stage("as-built variants"):
        return replace(shown, spreads=variant_spreads(model.limits, accepted.bodies))


def judge(
    model: DesignModel,
    out: RunFolder,
    announce: Announcer,
    iteration: DesignIteration,
    analysed: Analysed | None,
) -> Accepted:
    """Export the surface of an iteration's design and have it accepted or refused."""
    if analysed is None:
        with announce.stage("explicit"):
            model = with_design(model, iteration.rho, iteration.members)
            analysed = analyse_cells(model, iteration.rho, on_event=announce.listener)
    with announce.stage("acceptance"):
        accepted = accept_design(model, partial(written_back, out), iteration, analysed, announce)
    announce.limits("acceptance", accepted.rows)
    if accepted.unjudged:
        announce.say("acceptance", f"not accepted, {accepted.unjudged}")
    return accepted
