"""Neighbourhoods of about one cell: cubes, or the cells of a map."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.lattice.lattice import LatticeDesign
from gradedesign.geometry.maps.cell_map import CellMap
from gradedesign.geometry.maps.local_cells import local_cells

#: Neighbourhoods with less solid than this share of the median one are slivers at the border.
#: Chosen, not measured.
_LEAST_NEIGHBOURHOOD = 0.2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Neighbourhood:
    """Elements that lie together."""

    members: IntArray  #: ``(k,)``. Elements.
    centre: tuple[float, float, float]  #: mm.
    edge: float  #: mm. Of the cube about the centre that holds about one cell.


def neighbourhood_cells(design: LatticeDesign) -> CellMap | float:
    """Neighbourhoods of a lattice: cubes of the cell size where cells are equal cubes.

    Returns mm.
    """
    cell_map = design.cell_map
    if not isinstance(cell_map, CellMap):
        return design.cell_size
    if cell_map.name != "uniform":
        return cell_map
    cell = local_cells(cell_map, design.domain.lower[:, None])
    return design.cell_size if np.isclose(cell.least[0], cell.most[0]) else cell_map


def neighbourhoods(
    points: FloatArray, volumes: FloatArray, cells: CellMap | float
) -> Iterator[Neighbourhood]:
    """Divide elements into neighbourhoods twice, half a cell apart.

    ``points (3, M)``, mm: centroids. ``volumes (M,)``, mm^3. ``cells``, mm: cells of a map, or
    cubes of one size.

    Yields
    ------
    Neighbourhood
        That holds enough solid.
    """
    place = points / cells if isinstance(cells, float) else cells(points)
    for shift in (0.0, 0.5):
        index = np.floor(place + shift).astype(np.int64)
        # By one number each: sorting millions of triples takes more than four times as long.
        first = index.min(axis=1)
        shape = tuple(index.max(axis=1) - first + 1)
        number = np.ravel_multi_index(tuple(index - first[:, None]), shape)
        numbers, inverse = np.unique(number, return_inverse=True)
        keys = np.stack(np.unravel_index(numbers, shape)) + first[:, None]
        solid = np.bincount(inverse, weights=volumes, minlength=keys.shape[1])
        order = np.argsort(inverse, kind="stable")
        starts = np.searchsorted(inverse[order], np.arange(keys.shape[1] + 1))
        for b in np.flatnonzero(solid >= _LEAST_NEIGHBOURHOOD * np.median(solid)):
            members = order[starts[b] : starts[b + 1]]
            if isinstance(cells, float):
                centre, edge = (keys[:, b] - shift + 0.5) * cells, cells
            else:
                centre, edge = _middle(points[:, members], volumes[members], cells)
            x, y, z = (float(c) for c in centre)
            yield Neighbourhood(members=members, centre=(x, y, z), edge=edge)


def _middle(points: FloatArray, volumes: FloatArray, cells: CellMap) -> tuple[FloatArray, float]:
    """Centre of mass of a cell and the longest extent of the map's cells there."""
    centre = points @ volumes / volumes.sum()
    return centre, float(local_cells(cells, centre[:, None]).most[0])
