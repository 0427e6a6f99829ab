"""The solid of a design, before it is built."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray
from gradedesign.design.resolve.cell_choice import CellChoice
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.design.resolve.planned_solid import planned_part, planned_solid
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cell_surface import CellSurface, cell_surface
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.explicit.analysis import PlannedSolid
from gradedesign.mechanics.fe.modes import mode_room
from gradedesign.mechanics.limits.limit import mode_goals


def planned_design(model: DesignModel, rho: float | FloatArray) -> PlannedSolid:
    """Box, volume and surface of the solid that a design will have.

    Parameters
    ----------
    rho : float or (M,) array
        Relative density of the lattice, for every element of the part.
    """
    plan, homogenised = model.plan, model.homogenised
    latticed = homogenised.lattice_volumes
    weights = latticed / max(float(latticed.sum()), 1e-300)
    density = np.broadcast_to(np.asarray(rho, dtype=np.float64), weights.shape)
    part = planned_part(
        plan.part.surface,
        plan.domain,
        latticed=float(latticed.sum()),
        solid=float(homogenised.volumes @ homogenised.solid_fraction),
        load_cases=len(plan.case.load_case),
        goals=sum(limit.goal() is not None for limit in model.limits),
        modes=mode_room(mode_goals(model.limits).values()),
    )
    surfaces = CellSurface(np.zeros(weights.shape), np.zeros(weights.shape))
    for cell, here in _elements_by_cell(model.cells, homogenised.space.mesh):
        of_cell = cell_surface(cell, density[here], model.cells.layout.typical)
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
