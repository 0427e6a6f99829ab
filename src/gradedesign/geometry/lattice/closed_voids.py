"""Voids of a lattice from which no powder leaves, on a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.errors import ResourceError
from gradedesign.geometry.contour.sample import grid_points
from gradedesign.geometry.lattice.lattice import LatticeDesign, lattice_field
from gradedesign.geometry.lattice.solid_layers import solid_layers

#: Voxels along a cell, and how much larger they may be where the part is large. None is larger
#: than a skin is thick, so that none leaks.
PER_CELL, _COARSER = 16.0, 1.5
#: Most voxels of a grid. Chosen, not measured.
MOST_VOXELS = 12_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClosedVoids:
    """Voids without a way out of the part.

    Attributes
    ----------
    label : (nx, ny, nz) int array
        Number of the void that each voxel lies in, from 1; 0 elsewhere.
    volumes : (n,) array, mm^3
        Of the voids, those of voxels more than half a voxel from the solid.
    lower : (3,) array, mm
        Centre of the first voxel.
    spacing : float, mm
    """

    label: IntArray
    volumes: FloatArray
    lower: FloatArray
    spacing: float

    def __post_init__(self) -> None:
        lock(self, volumes=(None,), lower=(3,))


def closed_voids(design: LatticeDesign, cell: float, least: float) -> ClosedVoids:
    """Voids of at least a volume that touch no open face of the part.

    Voxels count as void more than half a voxel from the solid: no wall is too thin to part two of
    them, and throats narrower than a voxel count as closed.

    Parameters
    ----------
    cell : float, mm
        Shortest edge of a cell.
    least : float, mm^3
        Smaller voids are left out.

    Raises
    ------
    ResourceError
        If the grid would be too large.
    """
    domain = design.domain
    edges = domain.upper - domain.lower
    wished = min([cell / PER_CELL, *(solid.least for solid in domain.solids if solid.closes)])
    spacing = max(wished, float((edges.prod() / MOST_VOXELS) ** (1 / 3)))
    if spacing > wished * _COARSER:
        raise ResourceError(
            f"finding closed voids among {edges.prod() / cell**3:.3g} cells takes more than "
            f"{MOST_VOXELS:g} voxels of {wished:.3g} mm; name the places of drain holes in at"
        )
    # A layer of voxels lies outside the part all round.
    lower = domain.lower - 1.5 * spacing
    nx, ny, nz = (int(n) + 4 for n in np.ceil(edges / spacing))
    shape = (nx, ny, nz)
    field, part = lattice_field(design, band=2 * spacing), solid_layers(domain, 2 * spacing)[0]
    void, outside = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    for i in range(nx):
        points = grid_points(lower, (i, 0, 0), (1, ny, nz), spacing)
        outside[i] = part(points)[0] >= 0
        void[i] = field(points)[0] > 0.5 * spacing
    label, count = ndimage.label(void & ~outside)
    beside = ndimage.binary_dilation(outside) & ~outside
    opened = np.unique(label[beside])
    volumes = spacing**3 * np.bincount(label.ravel(), minlength=count + 1).astype(np.float64)
    closed = [n for n in range(1, count + 1) if n not in set(opened.tolist())]
    kept = [n for n in closed if volumes[n] >= least]
    number = np.zeros(count + 1, dtype=np.int64)
    number[kept] = 1 + np.arange(len(kept))
    return ClosedVoids(label=number[label], volumes=volumes[kept], lower=lower, spacing=spacing)


def void_at(voids: ClosedVoids, points: FloatArray) -> IntArray:
    """Number of the closed void at points ``(3, n)`` mm, ``(n,)``, 0 elsewhere."""
    index = np.rint((points - voids.lower[:, None]) / voids.spacing).astype(np.int64)
    shape = np.array(voids.label.shape)[:, None]
    inside = ((index >= 0) & (index < shape)).all(axis=0)
    numbers = np.zeros(points.shape[1], dtype=np.int64)
    numbers[inside] = voids.label[tuple(index[:, inside])]
    return numbers
