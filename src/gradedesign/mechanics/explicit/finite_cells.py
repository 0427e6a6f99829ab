"""Finite cells as an explicit analysis: of a lattice design, or of any field in its place."""

from __future__ import annotations

import logging
from collections.abc import Callable
from time import perf_counter

import numpy as np

from gradedesign.mechanics.explicit.analysis import (
    AnalysisEstimate,
    Discretisation,
    ExplicitAnalysis,
    PlannedSolid,
    Resolution,
)
from gradedesign.mechanics.explicit.bricks_within_budget import (
    BASE_BYTES,
    divided_within_budget,
    predict_memory,
)
from gradedesign.mechanics.explicit.finite_cell_fields import FiniteCellFields
from gradedesign.mechanics.explicit.grid_resolution import PER_SHEET, elements_per_wall
from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
from gradedesign.mechanics.explicit.spacing_for import spacing_for
from gradedesign.mechanics.finite_cell.analysis import solve_divided
from gradedesign.mechanics.finite_cell.stress import solid_parts
from gradedesign.mechanics.solver.lowest_modes import GUARD

log = logging.getLogger(__name__)

#: Order of the error of displacement and work in the spacing: the least, the usual and the most
#: that was observed; less than 1 where plates meet sheets in re-entrant edges and one cell is
#: across.
ORDERS = (0.75, 1.5, 3.0)
#: Seconds for each brick of the box (sampling its field) and each unknown (the first load case) on
#: two idle cores, and what a further load case adds as a share of the latter: set-up is shared.
_BRICK_S, UNKNOWN_S, MORE_CASES = 1e-4, 1.8e-5, 0.7
#: The same for each mode of the iteration that finds natural frequencies: five took three times
#: what a load case did without its set-up (gyroid sheets, 0.12 M unknowns).
_MODE = 0.7
#: Largest spacing over the one that walls ask for, where that does not fit the memory. Chosen, not
#: measured.
COARSEST = 1.25
#: Gaps narrower than this share of a brick are joined: the edge of a sub-cell.
_CLOSES = 0.25
#: Unknowns that are solved for in some 5 s and 0.3 GB.
AFFORDABLE = 3e5


def solve_finite_cells(
    solid: PrintedSolid, resolution: Resolution, say: Callable[[str], None]
) -> FiniteCellFields:
    """Divide a printed solid into finite cells and solve every load case on them.

    Raises `ResourceError` if no spacing that holds the solid fits the memory of the case,
    `LatticeError` if the solid falls apart or is not resolved, or a loaded or supported region
    carries none, and `SolverError` if supports leave rigid motions free, or the iteration does not
    converge.
    """
    began = perf_counter()
    divided = divided_within_budget(solid, resolution, say)
    problem, elements = divided.problem, divided.elements
    seconds = perf_counter() - began
    result = solve_divided(problem, elements, divided.space)
    for note in result.notes:
        log.info("%s", note)
    return FiniteCellFields(
        result=result,
        field=problem.field,
        division=Discretisation(
            made_by="finite cells",
            mesh_size=result.spacing,
            unknowns=result.unknowns,
            requested=divided.requested,
            refused=divided.refused,
            dropped_components=elements.dropped,
            seconds=seconds,
        ),
        parts=solid_parts(elements),
        bodies=problem.bodies,
    )


def estimate(planned: PlannedSolid, spacing: float) -> AnalysisEstimate:
    """Size of the analysis on bricks of a spacing, mm."""
    edges = np.ceil(np.asarray(planned.box) / spacing)
    bricks = float(edges.prod())
    unknowns = int(min(touched_unknowns(planned, spacing), 3.0 * float((2.0 * edges + 1.0).prod())))
    modes = _MODE * (planned.modes + GUARD) if planned.modes else 0.0
    return AnalysisEstimate(
        unknowns=unknowns,
        memory_bytes=predict_memory(unknowns, planned.modes),
        mesh_s=_BRICK_S * bricks,
        solve_s=UNKNOWN_S * unknowns * (1.0 + MORE_CASES * (planned.load_cases - 1) + modes),
    )


def touched_unknowns(planned: PlannedSolid, spacing: float) -> float:
    """Displacements at the nodes of all bricks that a solid touches, wherever the grid lies.

    A node is there if the solid reaches one of its bricks: if it lies in the solid, grown by a box
    of one or two bricks an edge. By Steiner's formula the volume of a solid grown by a box of edges
    a, b, c is ``V + (a + b + c) P / 6 + (ab + bc + ca) M / (2 pi)`` for a surface whose
    projections P along three axes are alike; a brick has 8 nodes of its own: its centre, and three
    faces, three edges and one corner that it shares.

    References
    ----------
    L. A. Santalo (1976), Integral Geometry and Geometric Probability, chapter III.13.
    """
    return (
        24.0 * planned.volume / spacing**3
        + 18.0 * planned.projections / spacing**2
        + 81.0 / np.pi * planned.curvature / spacing
    )


def fitted_spacing(planned: PlannedSolid, spacing: float, memory_bytes: float) -> float:
    """Longest edge that bricks have, mm: one that the memory holds and that divides the box."""
    each = predict_memory(1.0, planned.modes) - BASE_BYTES
    room = (memory_bytes - BASE_BYTES) / each
    if estimate(planned, spacing).unknowns > room:
        spacing = spacing_for(estimate, planned, room, spacing, COARSEST * spacing) or spacing
    box = np.asarray(planned.box)
    return float((box / np.ceil(box / spacing * (1.0 - 1e-9))).max())


#: Quadratic finite cells, ``[run] analysis = "finite-cells"``.
FINITE_CELLS = ExplicitAnalysis(
    name="finite-cells",
    solve=solve_finite_cells,
    estimate=estimate,
    fitted_spacing=fitted_spacing,
    elements_per_wall=elements_per_wall,
    elements_per_layer=PER_SHEET,
    coarsest=COARSEST,
    affordable=AFFORDABLE,
    closes=_CLOSES,
)
