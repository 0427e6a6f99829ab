"""Number of finite cells across the thinnest wall or strut of a cell.

A wall is thin in one direction, a strut in two, and bends where a wall carries load in its plane:
it needs more elements across. Which of them a cell consists of shows in the mean curvature of its
surface: 0 over a wall, whose faces curve to opposite sides, and one over the width along a strut.
"""

from __future__ import annotations

from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.cell_surface import PROJECTED, cell_surface
from gradedesign.geometry.cell.wall_size import wall_mm

#: Bricks across a wall or a solid layer: quadratic finite cells of 1.4 walls displace a gyroid
#: sheet within 3 % (8 bricks a cell at density 0.3).
PER_SHEET = 0.7
#: Bricks across a strut: those of the cell sc bend 18, 10 and 2 % too little or too much with 1.1,
#: 1.5 and 1.8, since facets between sub-cells take volume off them.
PER_STRUT = 1.8
#: Mean curvature of the surface times the width of the thinnest wall or strut, from which a cell
#: consists of struts: 1 along a round strut, less where joints are thick. At the densities below
#: the 138 cells here have 0.31 to 0.93 where struts are plain, up to 0.16 where walls are, and 0.17
#: to 0.3 in between: pores, and networks that exist at high densities only. Chosen among these.
_CURVED, DENSITIES = 0.25, (0.1, 0.2, 0.3)


def elements_per_wall(cell: Cell) -> float:
    """Bricks across the thinnest wall or strut of a cell for 2 to 3 % in displacement."""
    return PER_STRUT if _has_struts(cell) else PER_SHEET


def elements_across(volume: float, area: float, curvature: float) -> float:
    """Bricks across the walls or struts of any solid, as `elements_per_wall`.

    The diameter of its struts, if it has any, is four times its volume, mm^3, over the area of its
    surface, mm^2. ``curvature``, mm: integral of mean curvature over that.
    """
    return PER_STRUT if curvature / area * (4.0 * volume / area) >= _CURVED else PER_SHEET


def _has_struts(cell: Cell) -> bool:
    """Whether a cell consists of struts rather than of walls."""
    low, high = cell.window
    # A cell whose window holds none of the densities is looked at in the middle of it.
    inside = [rho for rho in DENSITIES if low < rho < high] or [0.5 * (low + high)]
    return max(curvature_over_width(cell, rho) for rho in inside) >= _CURVED


def curvature_over_width(cell: Cell, rho: float) -> float:
    """Mean curvature of a cell's surface times the width of its thinnest wall or strut."""
    projections, curvature = cell_surface(cell, rho, 1.0)
    return float(curvature * PROJECTED / projections * wall_mm(cell, rho, 1.0))
