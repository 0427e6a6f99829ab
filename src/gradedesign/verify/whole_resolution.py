"""The two resolutions at which acceptance analyses a whole printed solid, and what they take."""

from __future__ import annotations

from gradedesign.cell.cell import Cell
from gradedesign.verify.analysis import AnalysisEstimate, ExplicitAnalysis, PlannedSolid
from gradedesign.verify.finite_cells import FINITE_CELLS, bricks_per_grid_cell

#: One spacing over the next finer one.
RATIO = 1.5
#: Share of the stated time that one analysis may be predicted to take, beyond the first.
TIME_SHARE = 1.0 / 6.0


def first_spacing(analysis: ExplicitAnalysis, spacing: float, cell: Cell, rho: float) -> float:
    """Edge of the first bricks, mm: as fine as the explicit analysis of the iterations.

    Parameters
    ----------
    analysis : ExplicitAnalysis
        Of the iterations.
    spacing : float, mm
        Of a finite-cell analysis its bricks; of any other the grid of tetrahedra that it resolves
        walls like.
    cell : Cell
    rho : float
        Least relative density.
    """
    if analysis.name == FINITE_CELLS.name:
        return spacing
    return spacing / bricks_per_grid_cell(cell, rho)


def whole_estimates(
    planned: PlannedSolid, spacing: float
) -> tuple[AnalysisEstimate, AnalysisEstimate]:
    """Size of the first two analyses of a whole solid; ``spacing``, mm, is that of the first."""
    return (
        FINITE_CELLS.estimate(planned, spacing),
        FINITE_CELLS.estimate(planned, spacing / RATIO),
    )


def seconds(size: AnalysisEstimate) -> float:
    """Seconds of an analysis with its mesh, s."""
    return size.mesh_s + size.solve_s
