"""The solid of a design, before it is built."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.design.resolve.cell_choice import CellChoice
from gradedesign.design.resolve.planned_solid import planned_part, planned_solid
from gradedesign.design.resolve.setup import Setup
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cell_surface import CellSurface, cell_surface
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.explicit.analysis import PlannedSolid


def planned_design(setup: Setup, rho: float | FloatArray) -> PlannedSolid:
    """Box, volume and surface of the solid that a design will have.

    Parameters
    ----------
    setup : Setup
    rho : float or (M,) array
        Relative density of the lattice, for every element of the part.
    """
    problem, model = setup.problem, setup.model
    latticed = model.volumes * (1.0 - model.solid_fraction)
    weights = latticed / max(float(latticed.sum()), 1e-300)
    density = np.broadcast_to(np.asarray(rho, dtype=np.float64), weights.shape)
    part = planned_part(
        problem.part.surface,
        problem.domain,
        latticed=float(latticed.sum()),
        solid=float(model.volumes @ model.solid_fraction),
        load_cases=len(problem.case.load_case),
        goals=sum(limit.goal() is not None for limit in problem.limits),
    )
    surfaces = CellSurface(np.zeros(weights.shape), np.zeros(weights.shape))
    for cell, here in _elements_by_cell(setup.cells, problem.space.mesh):
        of_cell = cell_surface(cell, density[here], setup.cells.layout.typical)
        surfaces.projections[here], surfaces.curvature[here] = of_cell
    mean = CellSurface(weights @ surfaces.projections, weights @ surfaces.curvature)
    return planned_solid(part, float(weights @ density), mean)


def _elements_by_cell(cells: CellChoice, mesh: TetMesh) -> list[tuple[Cell, BoolArray | slice]]:
    """Cells with the elements that they fill; in a transition that of the heaviest zone."""
    if cells.zoning is None:
        return [(cells.cell, slice(None))]
    zones = cells.zoning.weights(centroids(mesh)).argmax(axis=0)
    numbers = np.array([zone.cell for zone in cells.zoning.zones])[zones]
    return [(cell, numbers == k) for k, cell in enumerate(cells.zoning.cells.members)]
