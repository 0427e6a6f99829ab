"""The cells that fill a part: their law, their densities, and their places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.design.resolve.zoning import Zoning, thinnest_feature
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.wall_size import wall_mm
from gradedesign.geometry.lattice.cell_layout import CellLayout
from gradedesign.geometry.lattice.density_grid import DensityGrid, evaluate
from gradedesign.geometry.maps.local_cells import local_cells
from gradedesign.geometry.tets.tet_mesh import centroids
from gradedesign.mechanics.fe.element_points import element_points
from gradedesign.mechanics.fe.space import TetSpace
from gradedesign.mechanics.material.scaling_law import ScalingLaw
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellChoice:
    """Cells of a design; where their size is graded, every design lays out its own."""

    cell: Cell
    law: ScalingLaw
    #: Intersection of the user's, the family's, the law's and the printer's density windows.
    bounds: tuple[float, float]
    elements_per_wall: float  #: Elements of the explicit analysis across the thinnest wall.
    layout: CellLayout
    #: Zones whose cells or densities differ; cell, law and elements are then those of what lies in
    #: no zone, ``bounds`` the least and the largest density of all.
    zoning: Zoning | None = None
    #: Rotations whose rows cells follow, points ``(3, ...)`` mm to ``(3, 3, ...)``.
    frames: Field | None = None


def cells_in_zones(
    cells: CellChoice,
) -> tuple[tuple[Cell, tuple[float, float], float], ...]:
    """Cell, density bounds and elements per wall of every zone, or of the one lattice."""
    zoning = cells.zoning
    if zoning is None:
        return ((cells.cell, cells.bounds, cells.elements_per_wall),)
    return tuple(
        (zoning.cells.members[z.cell], z.bounds, z.elements_per_wall) for z in zoning.zones
    )


def element_bounds(cells: CellChoice) -> tuple[FloatArray, FloatArray]:
    """Density bounds of the tetrahedra: two ``(M,)``, or scalars where all have the same."""
    if cells.zoning is None or cells.zoning.windows is None:
        return np.asarray(cells.bounds[0]), np.asarray(cells.bounds[1])
    return cells.zoning.windows


def cell_axes(layout: CellLayout, space: TetSpace) -> FloatArray:
    """Rotations of cell axes, ``(3, 3)`` where all cells lie alike, else ``(3, 3, 4, M)``.

    The latter at the Gauss points of the tetrahedra.
    """
    if layout.cell_map.name == "uniform":
        return local_cells(layout.cell_map, space.mesh.points[:, :1]).axes[:, :, 0]
    points = element_points(space).transpose(0, 2, 1)
    axes = local_cells(layout.cell_map, points.reshape(3, -1)).axes
    return axes.reshape(3, 3, *points.shape[1:])


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
