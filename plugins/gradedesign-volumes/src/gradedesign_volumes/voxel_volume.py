"""A sampled volume, as a file of voxels gives it: grey values on a grid, its spacing and unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Memory of a voxel while a surface is made of it, beside what is read: with smoothing, its copy in
#: double precision and its contour.
BYTES_PER_VOXEL = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoxelVolume:
    """Values on a grid, from a scan.

    Attributes
    ----------
    values : (nx, ny, nz) array of whole numbers, floats or booleans
        Along x, y and z; the outer corner of the first voxel is the origin.
    spacing : (float, float, float) or None
        Edges of a voxel in ``unit``; None where the file has none and the case says it.
    unit : str or None
        ``mm``, ``cm``, ``m`` or ``inch``; None where the file has none.
    """

    values: NDArray[np.generic]
    spacing: tuple[float, float, float] | None = None
    unit: str | None = None
    warnings: tuple[str, ...] = ()
