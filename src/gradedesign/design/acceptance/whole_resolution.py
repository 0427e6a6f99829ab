"""The two resolutions at which acceptance analyses a whole printed solid, and their cost."""

from __future__ import annotations

from dataclasses import replace

from gradedesign.geometry.cell.cell import Cell
from gradedesign.mechanics.explicit.analysis import AnalysisEstimate, ExplicitAnalysis, PlannedSolid
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS, UNKNOWN_S

#: One spacing over the next finer one. Chosen, not measured.
RATIO = 1.5
#: Share of the stated time that one analysis may be predicted to take, beyond the first. Chosen,
#: not measured.
TIME_SHARE = 1.0 / 6.0
#: Bytes that stay for each unknown of the iteration's analysis: weights of elements, displacements
#: and stress at the sample points (measured 126, gyroid sheets of density 0.15, 1.1 M unknowns).
_RESULT_BYTES = 140
#: Bytes of the search of the printed surface for each unknown of the iteration's analysis and of
#: the next coarser one of the surface (245 a triangle; `ramirez-whole` has 6.3 M triangles to 8.7 M
#: unknowns of both).
_SURFACE_BYTES = 180
#: Time of a dual over that of the first load case, and bytes of its displacements for each unknown:
#: a further load case takes 0.7, and a dual 13 iterations of its 19 (`load_cases.DUAL_ENERGY`;
#: gyroid sheets of density 0.3 between plates, four spacings).
_DUAL, _DUAL_BYTES = 0.5, 8
#: Seconds of an analysis of a printed surface beside its bricks and unknowns: supports, loads, the
#: search of the surface, stress measures. `mini`, where they count: 2.1 and 3.1 s of processor time
#: with 30,000 and 68,000 unknowns, 2.6 of these 5.2 by their number; `size-graded` took 20 s where
#: 15.6, and a block of 704 triangles 150 s, where they are nothing.
BESIDE_S = 1.3


def first_spacing(analysis: ExplicitAnalysis, spacing: float, cell: Cell) -> float:
    """Edge of the first bricks, mm: as fine as the explicit analysis of the iterations.

    ``analysis``: of the iterations. ``spacing``, mm: edge of its elements.
    """
    return spacing * analysis.elements_per_wall(cell) / FINITE_CELLS.elements_per_wall(cell)


def whole_estimates(
    planned: PlannedSolid, spacing: float, earlier_unknowns: int = 0
) -> tuple[AnalysisEstimate, AnalysisEstimate]:
    """Size of the first two analyses of a whole solid; ``spacing``, mm, is that of the first.

    ``earlier_unknowns`` are the unknowns of the iteration's analysis, whose result stays.
    """
    first = _judging_estimate(planned, spacing)
    return first, finer_estimate(planned, spacing / RATIO, earlier_unknowns)


def _judging_estimate(planned: PlannedSolid, spacing: float) -> AnalysisEstimate:
    """Size of an analysis that keeps the duals of its goals; ``spacing``, mm, is its own.

    Their time is none of the analysis' share of the stated time: the limits that a case states
    would make its lattice denser.
    """
    size = FINITE_CELLS.estimate(planned, spacing)
    duals = planned.goals * size.unknowns
    return replace(size, memory_bytes=size.memory_bytes + _DUAL_BYTES * duals)


def finer_estimate(
    planned: PlannedSolid, spacing: float, earlier_unknowns: int
) -> AnalysisEstimate:
    """Size of an analysis while the result of the iteration and the search of the surface stay.

    ``spacing``, mm. ``earlier_unknowns``: unknowns of the iteration's analysis.
    """
    size = _judging_estimate(planned, spacing)
    coarser = FINITE_CELLS.estimate(planned, spacing * RATIO).unknowns
    stays = _RESULT_BYTES * earlier_unknowns + _SURFACE_BYTES * (earlier_unknowns + coarser)
    return replace(size, memory_bytes=size.memory_bytes + stays)


def seconds(size: AnalysisEstimate) -> float:
    """Seconds of an analysis with its mesh, s."""
    return size.mesh_s + size.solve_s


def within_budgets(size: AnalysisEstimate, memory: float, time: float) -> bool:
    """Whether memory, bytes, and a sixth of the time, s, hold an analysis beyond the first."""
    return size.memory_bytes <= memory and seconds(size) <= TIME_SHARE * time


def judged_seconds(
    planned: PlannedSolid, spacing: float, earlier_unknowns: int, memory: float, time: float
) -> float:
    """Seconds of the two analyses that judge a whole solid, with their duals.

    The second one is finer than the first where the budgets hold that, else coarser, as
    `whole_solid.judge_whole` takes them.

    - ``spacing``, mm: of the first
    - ``earlier_unknowns``: unknowns of the iteration's analysis
    - ``memory``, bytes
    - ``time``, s
    """
    first, finer = whole_estimates(planned, spacing, earlier_unknowns)
    if not within_budgets(finer, memory, time):
        finer = _judging_estimate(planned, spacing * RATIO)
    duals = _DUAL * UNKNOWN_S * planned.goals * (first.unknowns + finer.unknowns)
    return seconds(first) + seconds(finer) + duals + 2 * BESIDE_S
