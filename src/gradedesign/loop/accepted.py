"""Judge a design: export its surface, read it back, analyse it whole and in body-fitted meshes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradedesign.errors import LatticeError
from gradedesign.lattice.islands import Islands
from gradedesign.lattice.printed_surface import printed_surface
from gradedesign.lattice.surface import require_closed
from gradedesign.limits.banded import Banded
from gradedesign.limits.key import LimitKey
from gradedesign.limits.limit import Limit
from gradedesign.limits.row import LimitRow
from gradedesign.limits.verdict import Factors, all_hold, learned_factors, limit_rows
from gradedesign.loop.announce import Announcer
from gradedesign.loop.iteration import Analysed, DesignIteration
from gradedesign.loop.printed_stage import printed_stage
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.output.stl import surface_of_stl
from gradedesign.resolve.lattice_files import STL_NAME, chord_tolerance, write_printed
from gradedesign.resolve.outer_triangles import keeps_outer
from gradedesign.resolve.setup import Setup
from gradedesign.verify.acceptance import (
    Acceptance,
    NoSubmodelError,
    accept_submodels,
    accept_whole,
    choose_scope,
)
from gradedesign.verify.submodel import SubmodelResult
from gradedesign.verify.whole_solid import WholeJudgement, judge_whole
from gradedesign.workspace.progress import report_step
from gradedesign.workspace.run_folder import RunFolder

#: Grid of the exported surface over the surface size of the explicit analysis.
SURFACE_PER_SPACING = 0.5
#: Utilisation of stress from which submodels give the next design a useful factor.
NEARLY = 0.85
#: Reason to leave submodels out: a limit that they do not evaluate is broken.
NOT_NEEDED = Acceptance(scope="none", whole=None, submodels=(), volume=0.0, share=0.0, attempts=())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accepted:
    """Design with the result of its acceptance.

    Attributes
    ----------
    iteration : DesignIteration
    analysed : Analysed
        Explicit analysis that judged it.
    surface : SurfaceMesh
        As read back from the exported file.
    sha256 : str
        Of that file.
    islands : Islands
    whole : WholeJudgement
        Of the whole printed surface, from two resolutions or more.
    acceptance : Acceptance
        By body-fitted meshes of it.
    rows : tuple of LimitRow
        The values that decide.
    factors : dict of LimitKey to float
        Unfavourable ends of the accepted bands over explicit values.
    fitted : frozenset of LimitKey
        Limits whose value is that of the body-fitted meshes.
    holds : bool
    unjudged : str
        Limits that were analysed at one resolution only, and why; empty where all have a band.
    """

    iteration: DesignIteration
    analysed: Analysed
    surface: SurfaceMesh
    sha256: str
    islands: Islands
    whole: WholeJudgement
    acceptance: Acceptance
    rows: tuple[LimitRow, ...]
    factors: Factors
    fitted: frozenset[LimitKey]
    holds: bool
    unjudged: str


def accept_design(
    setup: Setup,
    out: RunFolder,
    iteration: DesignIteration,
    analysed: Analysed,
    announce: Announcer,
) -> Accepted:
    """Export the surface of a design and have it accepted or refused.

    Every limit is judged on the whole printed surface, from two resolutions. Body-fitted meshes of
    the same surface judge stress: of all of it with scope "whole", whose displacements the bands
    then include, else of the most stressed submodels; these are left out where they can change
    nothing. A limit that has no band does not hold.
    """
    surface, islands, digest = export_surface(setup, out, analysed)
    began = time.perf_counter()
    limits = setup.problem.limits
    whole = judge_whole(
        limits, printed_stage(setup, surface, analysed, iteration.rho, announce.listener)
    )
    announce.took("whole printed surface", time.perf_counter() - began)
    acceptance = _body_fitted(setup, surface, analysed, whole, announce)
    if acceptance.scope == "whole":
        rows = with_remeshed(limits, whole.rows, acceptance)
    elif acceptance.scope == "submodels":
        rows = with_submodels(limits, whole.rows, acceptance.submodels)
    else:
        rows = whole.rows
    pairs = zip(whole.rows, rows, strict=True)
    fitted = [new for old, new in pairs if new.judged_by != old.judged_by and not new.converges]
    rows = (*rows, *(row for row in iteration.rows if row.homogenised))
    return Accepted(
        iteration=iteration,
        analysed=analysed,
        surface=surface,
        sha256=digest,
        islands=islands,
        whole=whole,
        acceptance=acceptance,
        rows=rows,
        factors=learned_factors(iteration.rows, rows),
        fitted=frozenset(row.key for row in fitted),
        holds=all_hold(rows) and not without_band(rows),
        unjudged=_unjudged(rows, whole.refused),
    )


def _body_fitted(
    setup: Setup,
    surface: SurfaceMesh,
    analysed: Analysed,
    whole: WholeJudgement,
    announce: Announcer,
) -> Acceptance:
    """Mesh and analyse the surface again, whole or around its most stressed cells.

    Stated budgets alone decide which of them: never the time that is left. Where no cell has room
    for a submodel, as in parts of few cells, it is the whole surface, unless the case asks for
    submodels by name.
    """
    run, division = setup.problem.case.run, analysed.result.solved.division
    by_submodels = choose_scope(run.acceptance, division.surface_tets, run.time) == "submodels"
    if by_submodels and (broken := _broken_anyhow(whole.rows)):
        announce.say("acceptance", f"submodels left out: {broken} is broken whatever they show")
        return NOT_NEEDED
    size, refused = division.surface_size, tuple[str, ...]()
    if by_submodels:
        try:
            return accept_submodels(
                surface,
                analysed.solid,
                whole.result,
                size=size,
                time_limit_s=run.time,
                on_submodel=announce.submodel,
            )
        except NoSubmodelError as error:
            if run.acceptance == "submodels":
                raise
            refused = (f"the whole surface was meshed again: {error}",)
            announce.say("acceptance", "no cell has room for a submodel: the whole surface instead")
    acceptance = accept_whole(surface, analysed.solid, size=size, time_limit_s=run.time)
    return replace(acceptance, refused=refused) if refused else acceptance


def _broken_anyhow(rows: Sequence[LimitRow]) -> str:
    """Name of a limit that is broken by a value that submodels do not judge; else empty.

    Also empty where a limit that they judge is nearly used up, so that the next design can learn
    from them.
    """
    if any(row.utilisation > NEARLY for row in rows if not row.converges):
        return ""
    broken = [row.name for row in rows if row.converges and not all_hold((row,))]
    return broken[0] if broken else ""


def export_surface(
    setup: Setup, out: RunFolder, analysed: Analysed
) -> tuple[SurfaceMesh, Islands, str]:
    """Extract the surface, drop islands, write the STL file and read it back.

    Returns
    -------
    surface : SurfaceMesh
        As read back.
    islands : Islands
    sha256 : str
        Of the file.

    Raises
    ------
    LatticeError
        If the surface in the file does not close as it is, or its volume differs from the analysed
        solid's by more than 5 %.
    ResourceError
        If the file that is read back is not the one that was written.
    """
    design, problem = analysed.design, setup.problem
    size = analysed.result.solved.division.surface_size
    step = SURFACE_PER_SPACING * size
    case, part = problem.case, problem.part.surface
    surface, islands = printed_surface(
        design, part, step, chord_tolerance(case), keep_outer=keeps_outer(case)
    )
    report_step("writing and reading back the surface")
    digest = write_printed(out, case, part, surface)
    back = surface_of_stl(out.read_bytes(STL_NAME), STL_NAME)
    volume, meshed = require_closed(back), analysed.result.volume
    if not np.isclose(volume, meshed, rtol=0.05):
        raise LatticeError(
            f"the exported surface encloses {volume:.6g} mm^3 but the explicit analysis holds "
            f"{meshed:.6g} mm^3; the explicit grid of {size:.3g} mm is too coarse "
            f"for {setup.cells.cell.name}: raise [run] elements_per_wall"
        )
    return back, islands, digest


def with_remeshed(
    limits: Sequence[Limit], rows: Sequence[LimitRow], acceptance: Acceptance
) -> tuple[LimitRow, ...]:
    """Rows beside the body-fitted mesh of the whole surface.

    It judges stress; the bands of values that converge are widened to hold its values.
    """
    if acceptance.whole is None:
        raise LatticeError("acceptance of the whole lattice returned no analysis")
    judge = "re-meshed whole lattice"
    remeshed = {row.key: row for row in limit_rows(limits, acceptance.whole, judge)}
    out = []
    for row in rows:
        remeshed_row = remeshed.get(row.key)
        if remeshed_row is None or (row.converges and row.band is None):
            out.append(row)
        elif not row.converges:
            ratio = remeshed_row.value / row.value if row.value else 1.0
            out.append(row.scaled(Banded(value=ratio, low=ratio, high=ratio), judge))
        elif row.band is not None:
            band = row.band.including(remeshed_row.value)
            words = f"{row.judged_by}; {remeshed_row.value:.4g} {row.unit} by {judge}"
            out.append(replace(row, band=band, judged_by=words))
    return tuple(out)


def with_submodels(
    limits: Sequence[Limit], rows: Sequence[LimitRow], submodels: Sequence[SubmodelResult]
) -> tuple[LimitRow, ...]:
    """Rows with the factors that submodels find for the limits that they can judge."""
    factors = {limit.key: limit.submodel_factor(submodels) for limit in limits}
    out = []
    for row in rows:
        factor = factors.get(row.key)
        words = f"{row.judged_by} times the ratio of {len(submodels)} submodels"
        out.append(row if factor is None else row.scaled(factor, words))
    return tuple(out)


def _unjudged(rows: Sequence[LimitRow], refused: Sequence[str]) -> str:
    """Limits without a band, with the resolutions that were refused; empty without any."""
    names = ", ".join(dict.fromkeys(row.name for row in without_band(rows)))
    return f"{names} at one resolution only: {'; '.join(refused)}" if names else ""


def without_band(rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows that were analysed at one resolution only, so that nothing is known of their error."""
    return tuple(row for row in rows if row.band is None and not row.homogenised)
