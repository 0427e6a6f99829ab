"""Judge a design: export its surface, read it back, analyse it whole and in body-fitted meshes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gradedesign.common.system.limits import Deadline
from gradedesign.design.acceptance.acceptance import (
    Acceptance,
    NoSubmodelError,
    accept_submodels,
    accept_whole,
    choose_scope,
    nothing_meshed,
)
from gradedesign.design.acceptance.meshed_anew import mesher_tets
from gradedesign.design.acceptance.whole_solid import WholeJudgement, WholeStage
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.loop.accepted_rows import (
    not_remeshed,
    unjudged_words,
    with_remeshed,
    with_submodels,
    without_band,
)
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.announce import Announcer
from gradedesign.design.loop.bodies import Bodies, judge_bodies, with_other_body
from gradedesign.design.loop.exported_surface import WrittenBack, export_surface
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.design.loop.printed_stage import printed_stage
from gradedesign.design.printing.as_built_body import as_built_body
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.errors import MeshError, ResourceError, SolverError
from gradedesign.geometry.contour.islands import Islands
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.yielding import yielding_words
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.limit import Limit, limits_stress
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.mechanics.limits.verdict import (
    Factors,
    all_hold,
    is_tight,
    learned_factors,
    worst_utilisation,
)

#: Utilisation of stress from which submodels give the next design a useful factor. Chosen, not
#: measured.
_NEARLY = 0.85
#: Utilisation of stress up to which submodels wait for the last design: twice what the finite cells
#: find, where submodels found 0.94 to 1.04 times that (docs/decisions/verify.md).
FAR = 0.5
#: Submodels are left out, or wait for the last design.
NO_SUBMODELS = Acceptance(
    scope="none", whole=None, submodels=(), volume=0.0, share=0.0, attempts=()
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accepted:
    """Design with the result of its acceptance."""

    iteration: DesignIteration
    analysed: Analysed  #: Explicit analysis that judged it.
    surface: SurfaceMesh  #: As read back from the exported file.
    sha256: str  #: Of that file.
    islands: Islands
    bodies: Bodies  #: Judgement of the whole printed surface, and of what is built of it.
    acceptance: Acceptance  #: By body-fitted meshes of it.
    rows: tuple[LimitRow, ...]  #: The values that decide.
    factors: Factors  #: By LimitKey. Unfavourable ends of the accepted bands over explicit values.
    fitted: frozenset[LimitKey]  #: Limits whose value is that of the body-fitted meshes.
    holds: bool
    #: Limits that were analysed at one resolution only, or too little of which could be meshed
    #: anew, and why; empty without any.
    unjudged: str
    #: Submodels wait until it is known that no lighter design is found: `judge_stress`.
    postponed: bool = False

    @property
    def whole(self) -> WholeJudgement:
        """Judgement of the whole surface of the body that decides, from two resolutions or more."""
        return self.bodies.whole


def accept_design(
    model: DesignModel,
    written_back: WrittenBack,
    iteration: DesignIteration,
    analysed: Analysed,
    announce: Announcer,
) -> Accepted:
    """Export the surface of a design and have it accepted or refused.

    Every limit is judged on the whole printed surface, from two resolutions. Body-fitted meshes of
    the same surface judge stress: of all of it with scope "whole", whose displacements the bands
    then include, else of the most stressed submodels; these are left out where they can change
    nothing, and postponed where stress is far from its limit and a lighter design is looked for. A
    limit that has no band does not hold.
    """
    limits, run = model.limits, model.plan.case.run
    surface, islands, digest = export_surface(model.plan, written_back, analysed)
    began = time.perf_counter()
    part = model.plan.part.surface
    built = as_built_body(model.plan.process, surface, part, analysed.layout.typical / 2.0)

    def staged(printed: SurfaceMesh, solid: PrintedSolid) -> WholeStage:
        return printed_stage(
            model, printed, solid, analysed.result, iteration.rho, announce.listener
        )

    bodies = judge_bodies(limits, staged, analysed.solid, surface, built, announce)
    whole = bodies.whole
    announce.took("whole printed surface", time.perf_counter() - began)
    limited = limits_stress(limits)
    announce.warnings(yielding_words(whole.result.yields, "the printed solid", limited=limited))
    remeshing = (analysed.result.volume, analysed.remeshed_size)
    waits = _judged_by_submodels(run, *remeshing) and _can_wait(iteration, whole)
    if waits:
        acceptance = NO_SUBMODELS
        announce.say("acceptance", "submodels wait for the last design: stress is far from its "
                     "limit, and a lighter design is looked for")  # fmt: skip
    else:
        acceptance = body_fitted(limits, run, bodies, remeshing, announce)
    exported = (surface, islands, digest)
    return _accepted(limits, exported, iteration, analysed, bodies, acceptance, postponed=waits)


def judge_stress(
    limits: Sequence[Limit], run: RunSpec, accepted: Accepted, announce: Announcer
) -> Accepted:
    """Have the submodels judge a design for which they were postponed."""
    done, bodies, analysed = accepted, accepted.bodies, accepted.analysed
    remeshing = (analysed.result.volume, analysed.remeshed_size)
    acceptance = body_fitted(limits, run, bodies, remeshing, announce)
    exported = (done.surface, done.islands, done.sha256)
    return _accepted(limits, exported, done.iteration, analysed, bodies, acceptance)


def _accepted(
    limits: Sequence[Limit],
    exported: tuple[SurfaceMesh, Islands, str],
    iteration: DesignIteration,
    analysed: Analysed,
    bodies: Bodies,
    acceptance: Acceptance,
    *,
    postponed: bool = False,
) -> Accepted:
    """Judge a design by the two analyses of its printed surface."""
    (surface, islands, digest), whole = exported, bodies.whole
    rows = corrected_rows(limits, whole.rows, acceptance)
    pairs = zip(whole.rows, rows, strict=True)
    fitted = [new for old, new in pairs if new.judged_by != old.judged_by and not new.converges]
    rows = with_other_body(bodies, rows)
    rows = (*rows, *(row for row in iteration.rows if row.homogenised))
    return Accepted(
        iteration=iteration,
        analysed=analysed,
        surface=surface,
        sha256=digest,
        islands=islands,
        bodies=bodies,
        acceptance=acceptance,
        rows=rows,
        factors=learned_factors(iteration.rows, rows),
        fitted=frozenset(row.key for row in fitted),
        holds=all_hold(rows) and not without_band(rows),
        unjudged=unjudged_words(rows, (*whole.refused, *bodies.refused), acceptance.refused),
        postponed=postponed,
    )


def corrected_rows(
    limits: Sequence[Limit], rows: Sequence[LimitRow], acceptance: Acceptance
) -> tuple[LimitRow, ...]:
    """Rows of finite cells on the whole surface, corrected by what was meshed anew of it.

    That analysis corrects the rows that it can judge.
    """
    if acceptance.scope == "whole":
        return with_remeshed(limits, rows, acceptance)
    if acceptance.scope == "submodels":
        return with_submodels(limits, rows, acceptance)
    return not_remeshed(rows) if acceptance.failed else tuple(rows)


def _judged_by_submodels(run: RunSpec, volume: float, size: float) -> bool:
    """Whether stress is judged by submodels and not by a mesh of the whole surface."""
    tets = mesher_tets(volume, size)
    return choose_scope(run.acceptance, tets, run.time) == "submodels"


def _can_wait(iteration: DesignIteration, whole: WholeJudgement) -> bool:
    """Whether the design holds, is not the last, and its stress is far from the limit."""
    rows = (*whole.rows, *(row for row in iteration.rows if row.homogenised))
    return (
        all_hold(rows)
        and not without_band(rows)
        and not is_tight(rows, at_lower_bound=iteration.at_lower_bound)
        and worst_utilisation([row for row in whole.rows if not row.converges]) <= FAR
    )


def body_fitted(
    limits: Sequence[Limit],
    run: RunSpec,
    bodies: Bodies,
    remeshing: tuple[float, float],
    announce: Announcer,
) -> Acceptance:
    """Mesh and analyse the surface again, whole or around its most stressed cells.

    ``remeshing``: volume of the solid, mm^3, and the surface size that resolves its walls, mm.

    Stated budgets alone decide which of them: never the time that is left. Submodels judge stress
    alone, and are left out where no limit is on it, unless the case asks for them by name. Where no
    cell has room for a submodel, as in parts of few cells, it is the whole surface, unless the case
    asks for submodels by name. Where the whole surface cannot be meshed or solved, submodels judge,
    unless the case asks for the whole by name; where neither can be made, the acceptance has
    failed.
    """
    surface, solid, whole = bodies.surface, bodies.solid, bodies.whole
    by_submodels = _judged_by_submodels(run, *remeshing)
    if by_submodels and run.acceptance != "submodels" and not limits_stress(limits):
        announce.say("acceptance", "submodels left out: no limit is on stress, which they judge")
        return NO_SUBMODELS
    if by_submodels and (broken := _broken_anyhow(whole.rows)):
        announce.say("acceptance", f"submodels left out: {broken} is broken whatever they show")
        return NO_SUBMODELS
    size, refused = remeshing[1], list[str]()
    clock = Deadline(run.time)

    def submodels() -> Acceptance:
        return accept_submodels(
            surface,
            solid,
            whole.result,
            count=run.submodel_count,
            size=size,
            time_limit_s=clock.seconds if by_submodels else clock.remaining(),
            on_submodel=announce.submodel,
        )

    if by_submodels:
        try:
            return _told(submodels(), refused, announce)
        except NoSubmodelError as error:
            if run.acceptance == "submodels":
                raise
            refused.append(f"the whole surface was meshed again: {error}")
            announce.say("acceptance", "no cell has room for a submodel: the whole surface instead")
    try:
        acceptance = accept_whole(surface, solid, size=size, time_limit_s=run.time)
    except (MeshError, ResourceError, SolverError) as error:
        refused.append(f"the whole surface was not analysed in a mesh of its own: {error}")
    else:
        return replace(acceptance, refused=tuple(refused)) if refused else acceptance
    if by_submodels or run.acceptance == "whole" or clock.expired():
        return _told(nothing_meshed(""), refused, announce)
    try:
        return _told(submodels(), refused, announce)
    except NoSubmodelError as error:
        return _told(nothing_meshed(str(error)), refused, announce)


def _told(acceptance: Acceptance, before: Sequence[str], announce: Announcer) -> Acceptance:
    """Announce an acceptance together with the resolutions that were refused before it."""
    refused = tuple(words for words in (*before, *acceptance.refused) if words)
    for words in refused:
        announce.say("acceptance", words)
    return replace(acceptance, refused=refused)


def _broken_anyhow(rows: Sequence[LimitRow]) -> str:
    """Name of a limit that is broken by a value that submodels do not judge; else empty.

    Also empty where a limit that they judge is nearly used up, so that the next design can learn
    from them.
    """
    if any(row.utilisation > _NEARLY for row in rows if not row.converges):
        return ""
    broken = [row.name for row in rows if row.converges and not all_hold((row,))]
    return broken[0] if broken else ""
