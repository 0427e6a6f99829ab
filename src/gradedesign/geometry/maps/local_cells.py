"""The cells that a map makes at points: their axes, and how thin, wide and long they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, lock, locked
from gradedesign.geometry.maps.cell_map import CellMap


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LocalCells:
    """Cells at points, from the derivative of their map.

    With singular values ``s`` of du/dx, a distance d in cell units is between ``d / max(s)`` and
    ``d / min(s)`` mm: walls are at least ``least`` times as thick as in cell units.
    """

    #: ``(3, 3, n)``. Rotations whose columns are the cell axes in global coordinates.
    axes: FloatArray
    #: ``(n,)``, mm. Shortest and longest extent of a cell, along its principal directions of
    #: stretch.
    least: FloatArray
    most: FloatArray  #: As `least`.
    size: FloatArray  #: ``(n,)``, mm. Edge of the cube of equal volume.
    #: ``(n,)``. Longest over shortest extent of the cell that a cell of the stated edges has
    #: become; 1 where it has only been turned and magnified.
    stretch: FloatArray

    def __post_init__(self) -> None:
        n = np.asarray(self.size).size
        lock(self, axes=(3, 3, n))
        for key in ("least", "most", "size", "stretch"):
            object.__setattr__(self, key, locked(getattr(self, key), (n,), name=key))


def local_cells(
    cell_map: CellMap, points: FloatArray, edges: Sequence[float] = (1.0, 1.0, 1.0)
) -> LocalCells:
    """Measure the cells of a map.

    Returns LocalCells: where the map is singular: global axes and the map's typical size, for
    points that hold no lattice.

    ``cell_map``: must not fold at the points. ``points (3, n)``, mm. ``edges (3,)``: edges, up to a
    factor, of the cell that counts as not stretched.

    Notes
    -----
    The axes are the rotation nearest to the directions in which the three coordinates grow: for
    cells with right angles, those directions themselves.
    """
    x = np.asarray(points, dtype=np.float64)
    used = np.ones(x.shape[1], dtype=np.bool_)
    if cell_map.singular is not None:
        used = ~np.asarray(cell_map.singular(x))
    slope = np.zeros((x.shape[1], 3, 3))
    scale = np.asarray(edges, dtype=np.float64) / np.prod(edges) ** (1 / 3)
    slope[:] = np.diag(1 / (scale * cell_map.size))
    if used.any():
        slope[used] = np.moveaxis(cell_map.jacobian(x[:, used]), -1, 0)
    if (slope == slope[:1]).all():  # cells that are alike are measured once
        slope = slope[:1]
    singular = np.linalg.svd(slope, compute_uv=False)
    undone = np.linalg.svd(scale[:, None] * slope, compute_uv=False)
    unit = slope / np.linalg.norm(slope, axis=2, keepdims=True)
    left, _, right = np.linalg.svd(unit)
    rotation = left @ right
    count = used.size
    return LocalCells(
        axes=np.broadcast_to(np.moveaxis(rotation, 0, -1).transpose(1, 0, 2), (3, 3, count)),
        least=np.broadcast_to(1 / singular[:, 0], count),
        most=np.broadcast_to(1 / singular[:, 2], count),
        size=np.broadcast_to(1 / np.cbrt(singular.prod(axis=1)), count),
        stretch=np.broadcast_to(undone[:, 0] / undone[:, 2], count),
    )
