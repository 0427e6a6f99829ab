"""Number of grid elements across the thinnest wall or strut of a cell, measured on the cell itself.

Isosurface stuffing keeps a wall of 1.25 elements, but rounds a strut of 2 to an eighth less volume
and loses one of 1.25: what a feature needs depends on its shape. One period of the cell is
meshed on ever finer grids until its volume is near enough to the density it stands for. Whether a
cell is one of walls shows where it is thin: thick struts and their joints may keep their volume at
1.25 elements by chance.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.cell.cell import Cell
from gradedesign.cell.content_key import cell_key
from gradedesign.cell.wall_size import wall_mm
from gradedesign.errors import MeshError
from gradedesign.mesh.stuffing import stuff
from gradedesign.mesh.tet_mesh import TetMesh, signed_volumes
from gradedesign.workspace.cache import content_key, load_arrays, store_arrays

KIND, SHEET_KIND = "elements-per-wall-2", "sheet"
#: Elements across a solid layer with plane faces, and at least across anything.
LAYER_ELEMENTS = 1.25
#: Elements across the thinnest wall that are tried, coarsest first. What is no wall has two at
#: least: with fewer, joints may make up for the volume that struts lose.
TRIED = (LAYER_ELEMENTS, 2.0, 2.25, 2.5, 2.75, 3.0, 3.5)
#: Densities at which a cell of walls keeps its volume with the first of them, where it exists.
SHEET_DENSITIES = (0.1, 0.2, 0.3)
#: Relative error of the volume that the thinnest walls of a design may have. Denser cells have
#: less, so that the whole lattice keeps within the tolerance of its mesh.
CELL_TOLERANCE = 0.06
#: Corners of a cell at which the grid begins, in elements: where struts lie on planes of the grid
#: or between them changes the volume, so the mean over some places counts.
PLACES = ((0.13, 0.27, 0.41), (0.61, 0.83, 0.07), (0.37, 0.53, 0.71))
#: Corner of the period that is counted, cells: off the planes in which walls and struts often lie.
CORNER = (0.31, 0.37, 0.43)
#: Grids of more elements per edge are not tried: cells as thin as this are sheets, which need
#: least.
MOST_ELEMENTS = 110


def elements_per_wall(cell: Cell, rho: float) -> float:
    """Grid elements across the thinnest wall with which a cell keeps its volume.

    Parameters
    ----------
    cell : Cell
        Of the cell, with its parameters.
    rho : float
        Relative density; the least of a design needs most.

    Returns
    -------
    float
        The least of `TRIED` with which the volume of a period is within `CELL_TOLERANCE`, or the
        finest that `MOST_ELEMENTS` allow.
    """
    return _elements_per_wall(cell, round(float(rho), 4))


@lru_cache(maxsize=64)
def _elements_per_wall(cell: Cell, rho: float) -> float:
    key = content_key(KIND, cell_key(cell), rho)
    stored = load_arrays(KIND, key)
    if stored is not None:
        return float(stored["elements"])
    elements = _measured(cell, rho)
    store_arrays(KIND, key, elements=elements)
    return elements


def _measured(cell: Cell, rho: float) -> float:
    """The coarsest of `TRIED` that keeps the volume of a period, by meshing it."""
    wall = float(wall_mm(cell, rho, 1.0))
    tried = TRIED if _sheet(cell) else TRIED[1:]
    coarsest = tried[0]
    for elements in tried:
        if _too_fine(cell, wall, elements):
            break
        coarsest = elements
        if _keeps_volume(cell, rho, wall, elements):
            break
    return coarsest


def _sheet(cell: Cell) -> bool:
    """Whether a cell consists of walls: the first of `TRIED` keeps the volume of thin ones."""
    key = content_key(SHEET_KIND, cell_key(cell))
    stored = load_arrays(SHEET_KIND, key)
    if stored is not None:
        return bool(stored["sheet"])
    low, high = cell.window
    sheet = True
    for rho in SHEET_DENSITIES:
        wall = float(wall_mm(cell, rho, 1.0)) if low < rho < high else 0.0
        if not _too_fine(cell, wall, TRIED[0]):
            sheet = sheet and _keeps_volume(cell, rho, wall, TRIED[0])
    store_arrays(SHEET_KIND, key, sheet=sheet)
    return sheet


def _too_fine(cell: Cell, wall: float, elements: float) -> bool:
    """Whether a wall, in cells, needs a finer grid than is tried."""
    return wall <= 0 or cell.family.period * elements / wall > MOST_ELEMENTS


def _keeps_volume(cell: Cell, rho: float, wall: float, elements: float) -> bool:
    """Whether a period meshed with so many elements across its wall has its volume."""
    # A long period shows its struts in many places of the grid by itself.
    places = PLACES if cell.family.period == 1 else PLACES[:1]
    volumes = [_volume(cell, rho, wall / elements, np.array(place)) for place in places]
    return abs(float(np.mean(volumes)) / rho - 1.0) <= CELL_TOLERANCE


def _volume(cell: Cell, rho: float, h: float, place: FloatArray) -> float:
    """Share of a period that its mesh on elements of ``h`` cells holds."""
    family, period = cell.family, float(cell.family.period)
    level = float(cell.level_of(rho))
    count = int(np.ceil(period / h)) + 9
    corner = np.array(CORNER)
    lower = corner + (place - 5.0) * h
    middle, half = lower + 0.5 * count * h, (0.5 * count - 1.0) * h

    def field(points: FloatArray) -> FloatArray:
        beside = (1,) * (points.ndim - 1)
        box = np.abs(points - middle.reshape(3, *beside)).max(axis=0) - half
        return np.maximum(family.shape(points, **cell.parameters) - level, box)

    try:
        mesh = stuff(field, lower, (count, count, count), h)
    except MeshError:
        return 0.0  # nothing was left of it
    return float((signed_volumes(mesh) * _share_inside(mesh, corner, period)).sum()) / period**3


def _share_inside(mesh: TetMesh, corner: FloatArray, period: float) -> FloatArray:
    """Share of every tetrahedron inside the period, from its corners and centre, ``(M,)``."""
    points = mesh.points - corner[:, None]
    inside = np.all((points >= 0) & (points < period), axis=0)
    corners = mesh.tets
    centre = points[:, corners].mean(axis=1)
    at_centre = np.all((centre >= 0) & (centre < period), axis=0)
    # The rule of degree two for tetrahedra: 4/5 at the centre, 1/20 at every corner.
    return np.asarray(0.8 * at_centre + 0.05 * np.asarray(inside)[corners].sum(axis=0))
