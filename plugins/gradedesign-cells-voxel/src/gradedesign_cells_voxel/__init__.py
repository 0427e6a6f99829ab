"""Cells for gradedesign from voxel arrays, mesh files and libraries of increments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gradedesign import CellFamily, CellMaker, ScalingLaw, hookimpl, shipped_laws
from gradedesign_cells_voxel import helix_library, stored_cells
from gradedesign_cells_voxel.increments import cell_from_increments, cell_from_nested_increments
from gradedesign_cells_voxel.mesh_cell import cell_from_mesh
from gradedesign_cells_voxel.voxel_cell import VoxelReading, cell_from_voxels

__all__ = [
    "VoxelReading",
    "cell_from_increments",
    "cell_from_mesh",
    "cell_from_nested_increments",
    "cell_from_voxels",
    "gradedesign_cell_families",
    "gradedesign_cell_makers",
    "gradedesign_scaling_laws",
]


@hookimpl
def gradedesign_cell_families() -> Iterator[CellFamily]:
    """Register the cells that come with this distribution."""
    yield from helix_library.FAMILIES
    yield from stored_cells.FAMILIES


_COMMON = {
    "resolution": "steps of the table of distances along a cell",
    "tolerance": "share of opposite faces that may differ",
    "symmetry": "of the stiffness, if known: cubic, tetragonal, orthotropic or none",
    "source": "where the cell comes from",
}


@hookimpl
def gradedesign_cell_makers() -> Iterator[CellMaker]:
    """Register the makers of cells from the files that a case names."""
    yield CellMaker(
        name="mesh",
        make=_from_mesh,
        options={"box": "[[x, y, z], [x, y, z]], the cell's corners in mm", **_COMMON},
        suffixes=(".stl",),
        source="cell_from_mesh of gradedesign-cells-voxel",
    )
    yield CellMaker(
        name="voxels",
        make=_from_voxels,
        options={
            "level": "values above are solid",
            "smooth": "width in voxels of a filter against steps",
            "endpoint": "true if the last plane repeats the first",
            "interpolation": "cubic or linear",
            **_COMMON,
        },
        suffixes=(".npy", ".npz"),
        source="cell_from_voxels of gradedesign-cells-voxel",
    )


def _from_mesh(name: str, file: Path, **options: Any) -> CellFamily:
    """`cell_from_mesh` with the name first."""
    return cell_from_mesh(file, name=name, **options)


def _from_voxels(name: str, file: Path, **options: Any) -> CellFamily:
    """`cell_from_voxels` of the flat options of a case."""
    reading = {key: options.pop(key) for key in VoxelReading.__slots__ if key in options}
    return cell_from_voxels(file, name=name, reading=VoxelReading(**reading), **options)


@hookimpl
def gradedesign_scaling_laws() -> Iterator[ScalingLaw]:
    """Register the laws computed for these cells."""
    yield from shipped_laws(f"{__name__}.properties")
