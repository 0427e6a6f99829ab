"""Rows that an acceptance decides on: of the whole printed surface, with its body-fitted meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.common.system.progress import Event, Listener
from gradedesign.design.acceptance.acceptance import Acceptance
from gradedesign.design.acceptance.whole_resolution import RATIO
from gradedesign.design.acceptance.whole_solid import WholeStage, judge_whole
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.errors import LatticeError
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, Resolution
from gradedesign.mechanics.explicit.explicit import ExplicitResult, analyse_printed_solid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS, ORDERS
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LEAST_JUDGED, LimitRow
from gradedesign.mechanics.limits.verdict import limit_rows


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
    limits: Sequence[Limit], rows: Sequence[LimitRow], acceptance: Acceptance
) -> tuple[LimitRow, ...]:
    """Rows with the factors that submodels find for the limits that they can judge.

    Where one was left out, the analysis that drives it judges there alone: its factor is one.
    """
    submodels, left_out = acceptance.submodels, acceptance.left_out
    factors = {limit.key: limit.submodel_factor(submodels) for limit in limits}
    least = 1.0 if left_out else 0.0
    without = f", {left_out} left out" if left_out else ""
    out = []
    for row in rows:
        factor = factors.get(row.key)
        if factor is None:
            out.append(row)
            continue
        ends = (max(each, least) for each in (factor.value, factor.low, factor.high))
        value, low, high = ends
        words = f"{row.judged_by} times the ratio of {len(submodels)} submodels{without}"
        scaled = row.scaled(Banded(value=value, low=low, high=high), words)
        out.append(replace(scaled, remeshed=acceptance.judged))
    return tuple(out)


def not_remeshed(rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows where no independent mesh could be made: values that it was to judge do not hold."""
    return tuple(row if row.converges else replace(row, remeshed=0.0) for row in rows)


def unjudged_words(
    rows: Sequence[LimitRow], refused: Sequence[str], not_meshed: Sequence[str]
) -> str:
    """Limits without a band or without enough of an independent mesh, and why; empty if none.

    ``refused``: resolutions that could not be analysed. ``not_meshed``: what could not be meshed
    anew and solved.
    """
    coarse = without_band(rows)
    missing = [row for row in rows if row.remeshed < LEAST_JUDGED]
    told = (
        (coarse, "at one resolution only", refused),
        (missing, "without an independent mesh", not_meshed),
    )
    return "; ".join(
        f"{', '.join(dict.fromkeys(row.name for row in some))} {what}: {'; '.join(why)}"
        for some, what, why in told
        if some
    )


def without_band(rows: Sequence[LimitRow]) -> tuple[LimitRow, ...]:
    """Rows analysed at one resolution only, whose error is unknown."""
    return tuple(row for row in rows if row.band is None and not row.homogenised)


#: Coarser over the finer spacing: that of acceptance, and a smaller one where walls fall apart at
#: it, which makes bands wider. Chosen, not measured.
_RATIOS = (RATIO, 1.2)


def best_rows(
    limits: Sequence[Limit],
    analysis: ExplicitAnalysis,
    best: DesignIteration,
    analysed: Analysed,
    on_event: Listener,
) -> tuple[LimitRow, ...]:
    """Rows of the limits by an explicit analysis, with the bands that a coarser one gives.

    The coarser one has a third of its unknowns, so that a run whose time is used up ends with
    bands too. A row has none where no coarser elements hold the solid.
    """
    size = analysed.result.mesh_size

    def analyse(spacing: float) -> ExplicitResult:
        if spacing == size:
            return analysed.result
        return analyse_printed_solid(
            analysis,
            analysed.solid,
            Resolution(spacing=spacing),
            lambda message: on_event(Event(stage="explicit", message=message)),
        )

    stage = WholeStage(
        analyse=analyse,
        spacing=size,
        ratio=_RATIOS[0],
        orders=ORDERS if analysis.name == FINITE_CELLS.name else None,
        judged_by="explicit analysis",
        need=lambda spacing: (spacing > size, "no acceptance asks for finer ones"),
    )
    rows: tuple[LimitRow, ...] = ()
    for ratio in _RATIOS:
        rows = judge_whole(limits, replace(stage, ratio=ratio)).rows
        if not without_band(rows):
            break
    return (*rows, *(row for row in best.rows if row.homogenised))
