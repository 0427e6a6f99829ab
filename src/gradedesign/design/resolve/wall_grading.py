"""Thickness of a design's walls and layers from place to place, over that of the thinnest."""

from __future__ import annotations

import logging

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.design.resolve.cell_choice import CellChoice
from gradedesign.design.resolve.design_model import DesignModel
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.tets.tet_mesh import centroids

log = logging.getLogger(__name__)

#: Share of the part in which elements may be twice as large, from which that pays: large elements
#: stand for 4 to 5 small ones on sheets, so that it saves 30 % of them.
LEAST_SHARE = 0.38


def wall_grading(model: DesignModel, grid: DensityGrid, spacing: float) -> Field | None:
    """Allowed element size of an explicit analysis at a place, over that at the thinnest wall.

    ``grid``: of the design. ``spacing``, mm: that the thinnest wall or layer asks for.

    Returns
    -------
    callable or None
        Points ``(3, ...)`` mm to ratios ``(...)``, 1 or more; between the nodes of the density grid
        the thinner ones count more. None where less than `LEAST_SHARE` of the part bears elements
        of twice the edge, zones have different cells, or nets lie on the part.
    """
    cells, domain, analysis = model.cells, model.plan.domain, model.plan.tools.analysis
    if cells.zoning is not None or domain.on_cells:
        return None
    walls = wall_mm(cells.cell, grid.values, _sizes(cells, grid))
    # Where walls are thicker than the thinnest, this is less than 1.
    share = spacing * cells.elements_per_wall / np.maximum(walls, 1e-9 * cells.layout.least)
    shares = DensityGrid(origin=grid.origin, spacing=grid.spacing, values=np.clip(share, 0.0, 1.0))
    # Layers that bear elements of twice the edge ask for nothing.
    thin = [
        solid
        for solid in domain.solids
        if solid.least < 2.0 * spacing * analysis.elements_per_layer
    ]
    deep = any(solid.part_depth for solid in thin)

    def grading(points: FloatArray) -> FloatArray:
        ratio = 1.0 / np.maximum(evaluate(shares, points), 1e-9)
        to_part = domain.distance(points) if deep else None
        for solid in thin:
            wanted = max(solid.least / (spacing * analysis.elements_per_layer), 1.0)
            there = solid.distance(points, to_part) <= 0.0
            ratio = np.where(there, np.minimum(ratio, wanted), ratio)
        return ratio

    volumes, centres = model.homogenised.volumes, centroids(model.homogenised.space.mesh)
    share_of_part = float(volumes[grading(centres) >= 2.0].sum() / volumes.sum())
    log.info(
        "%.0f %% of the part has walls at least twice as thick as the thinnest%s",
        100 * share_of_part,
        "" if share_of_part >= LEAST_SHARE else ": too little for local refinement to pay",
    )
    return grading if share_of_part >= LEAST_SHARE else None


def _sizes(cells: CellChoice, grid: DensityGrid) -> FloatArray | float:
    """Shortest extent of the cells at the nodes of a grid, mm."""
    layout = cells.layout
    if layout.cell_map.name == "uniform":
        return layout.least
    nodes = grid_points(grid.origin, (0, 0, 0), grid.values.shape, grid.spacing).reshape(3, -1)
    return local_cells(layout.cell_map, nodes).least.reshape(grid.values.shape)
