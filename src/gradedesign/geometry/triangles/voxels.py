"""Voxels of a closed surface: which centres of a cubic grid lie inside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, locked
from gradedesign.geometry.triangles._voxel_kernels import add_triangles, fill_solid
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh

#: Memory of a voxel while a surface is filled.
BYTES_PER_VOXEL = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoxelGrid:
    """A cubic grid in axes of its own.

    Attributes
    ----------
    frame : (3, 3) array
        Rows are its axes, a rotation.
    first : (3,) array, mm
        Centre of the first voxel along these axes.
    step : float, mm
    shape : (int, int, int)
    """

    frame: FloatArray
    first: FloatArray
    step: float
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame", locked(self.frame, (3, 3), name="frame"))
        object.__setattr__(self, "first", locked(self.first, (3,), name="first"))

    def place(self, index: FloatArray) -> tuple[float, float, float]:
        """Place of an index ``(3,)``, which need not be whole, in the axes of the part, mm."""
        x, y, z = ((self.first + self.step * np.asarray(index)) @ self.frame).tolist()
        return x, y, z


def grid_around(surface: SurfaceMesh, frame: FloatArray, step: float, margin: int) -> VoxelGrid:
    """The grid around a surface with ``margin`` empty voxels on every side.

    The lowest of its layers that may be solid begins where the surface does.
    """
    turned = surface.vertices @ frame.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    nx, ny, nz = (int(n) + 2 * margin for n in np.maximum(np.ceil((high - low) / step - 1e-9), 1))
    return VoxelGrid(frame=frame, first=low + (0.5 - margin) * step, step=step, shape=(nx, ny, nz))


def solid_voxels(surface: SurfaceMesh, grid: VoxelGrid) -> BoolArray:
    """Voxels whose centre lies inside a closed surface, where its winding number is at least 1."""
    turned = (surface.vertices @ grid.frame.T - grid.first) / grid.step
    steps = np.zeros(grid.shape, dtype=np.int16)
    add_triangles(np.ascontiguousarray(turned[surface.faces]), steps)
    solid = np.zeros(grid.shape, dtype=np.bool_)
    fill_solid(steps, solid)
    return solid
