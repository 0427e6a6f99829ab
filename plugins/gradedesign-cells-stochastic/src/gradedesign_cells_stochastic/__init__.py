"""Random cells for gradedesign: Voronoi and Delaunay foams, spinodoids, random spheres."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, ScalingLaw, hookimpl, shipped_laws
from gradedesign_cells_stochastic import foams, random_spheres, spinodoid

__all__ = ["gradedesign_cell_families", "gradedesign_scaling_laws"]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register every random cell."""
    for cell in (foams, random_spheres, spinodoid):
        yield from cell.FAMILIES


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from shipped_laws(f"{__name__}.properties")
