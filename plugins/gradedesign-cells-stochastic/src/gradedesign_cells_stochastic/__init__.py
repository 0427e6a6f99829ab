"""Random cells for gradedesign: Voronoi and Delaunay foams, spinodoids, random spheres."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, hookimpl
from gradedesign_cells_stochastic import (
    delaunay,
    random_spheres,
    spinodoid,
    voronoi_closed,
    voronoi_open,
)

__all__ = ["gradedesign_cell_families"]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register every random cell."""
    for cell in (delaunay, random_spheres, spinodoid, voronoi_closed, voronoi_open):
        yield from cell.FAMILIES
