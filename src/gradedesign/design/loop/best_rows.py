"""Limits of the best design that no acceptance judged, by its explicit analysis, with bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradedesign.common.system.progress import Event, Listener
from gradedesign.design.acceptance.whole_resolution import RATIO
from gradedesign.design.acceptance.whole_solid import WholeStage, judge_whole
from gradedesign.design.loop.accepted_rows import without_band
from gradedesign.design.loop.analysed import Analysed
from gradedesign.design.loop.iteration import DesignIteration
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis, Resolution
from gradedesign.mechanics.explicit.explicit import ExplicitResult, analyse_printed_solid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS, ORDERS
from gradedesign.mechanics.limits.limit import Limit
from gradedesign.mechanics.limits.row import LimitRow

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
