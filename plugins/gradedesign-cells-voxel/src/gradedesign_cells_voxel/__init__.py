"""Cells for gradedesign from voxel arrays, mesh files and libraries of increments."""

from __future__ import annotations

from collections.abc import Iterator

from gradedesign import CellFamily, hookimpl
from gradedesign_cells_voxel import helix_library, stored_cells
from gradedesign_cells_voxel.increments import cell_from_increments, cell_from_nested_increments
from gradedesign_cells_voxel.mesh_cell import cell_from_mesh
from gradedesign_cells_voxel.voxel_cell import cell_from_voxels

__all__ = [
    "cell_from_increments",
    "cell_from_mesh",
    "cell_from_nested_increments",
    "cell_from_voxels",
    "gradedesign_cell_families",
]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the cells that come with this distribution."""
    yield from helix_library.FAMILIES
    yield from stored_cells.FAMILIES
