"""The thinnest wall or strut of a design, where cells and densities differ from place to place."""

from __future__ import annotations

from gradedesign.design.resolve.cell_choice import CellChoice
from gradedesign.design.resolve.zoning import thinnest_feature
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


def thinnest_wall(
    homogenised: HomogenisedModel, cells: CellChoice, grid: DensityGrid
) -> tuple[float, float]:
    """Thinnest wall or strut of a density field and the same over its elements, both mm.

    Equal cells: that of the least density. Otherwise the thinnest over the tetrahedra that hold
    lattice, each with its own density and the shortest extent of its own cells. Zones of different
    cells: that of every cell where it is, and of their mixes.
    """
    if cells.zoning is not None and cells.zoning.cells.weights is not None:
        points = cells.layout.points
        return thinnest_feature(cells.zoning, points, evaluate(grid, points), cells.layout.least)
    wall = _thinnest(homogenised, cells, grid)
    return wall, wall / cells.elements_per_wall


def _thinnest(homogenised: HomogenisedModel, cells: CellChoice, grid: DensityGrid) -> float:
    """Thinnest wall or strut of one cell, mm."""
    layout = cells.layout
    if layout.cell_map.name == "uniform":
        least = float(grid.values.min())
        return float(wall_mm(cells.cell, least, layout.least))
    lattice = homogenised.solid_fraction < 1
    if not lattice.any():
        return float(wall_mm(cells.cell, cells.bounds[0], layout.typical))
    points = centroids(homogenised.space.mesh)[:, lattice]
    density = evaluate(grid, points)
    sizes = local_cells(layout.cell_map, points).least
    walls = wall_mm(cells.cell, density, sizes)
    return float(walls.min())
