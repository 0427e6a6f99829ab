"""Stiffness of a wall of few cells, cut where its faces lie, over that of the periodic lattice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gradedesign.arrays import FloatArray, lock
from gradedesign.errors import SolverError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape
from gradedesign.mechanics.homogenise.islands import connected_wall
from gradedesign.mechanics.homogenise.periodic import solve_periodic
from gradedesign.mechanics.homogenise.sampling import SUBSAMPLES
from gradedesign.mechanics.homogenise.wall import PLANE, wall_stiffness

#: Residual of the solves: ratios are right to its square, shear to 0.1 % and, in a thin network,
#: to 0.6 % (measured against 1e-7).
RTOL = 1e-3
#: Share of the shear stiffness that is left of ``G h`` in a homogeneous plate.
_UNIFORM_SHEAR = 5 / 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WallRatios:
    """A wall over a plate of the same thickness and the periodic stiffness.

    Directions are the two axes of the cell that follow the wall's normal in the cycle x, y, z.
    """

    solid: float  #: Density of the wall over that of the periodic lattice.
    #: ``(3,)``. Along the first direction, the second, and shear or twist between them.
    membrane: FloatArray
    bending: FloatArray
    shear: FloatArray  #: ``(2,)``. Transverse, along the first direction and the second.

    def __post_init__(self) -> None:
        lock(self, membrane=(3,), bending=(3,), shear=(2,))


def wall_ratios(
    cell: Cell,
    rho: float,
    *,
    axis: int,
    lower: float,
    upper: float,
    resolution: int,
    poissons_ratio: float = 0.3,
) -> WallRatios:
    """Homogenise a wall across one axis of the cells and compare it with the periodic lattice.

    Raises `LatticeError` if the wall does not hang together, and `SolverError` if a solve does not
    converge, or the wall is no thicker than two voxels.

    - ``rho``: relative density of the periodic lattice
    - ``axis``: normal of the wall: 0, 1 or 2
    - ``lower``, ``upper``: its faces along the axis, in cells
    - ``resolution``: voxels along a cell
    """
    level = float(cell.level_of(rho))
    whole, periodic = _periodic(cell, level, axis, resolution, poissons_ratio)
    plane = np.linalg.inv(np.linalg.inv(periodic)[np.ix_(PLANE, PLANE)])
    cut, middle = _cut_fill(cell, level, axis, lower, upper, resolution)
    if cut.shape[2] < 2:
        raise SolverError(
            f"a wall of {upper - lower:.3g} cells has {cut.shape[2]} voxels across; expected 2"
        )
    cut = connected_wall(cut)
    wall = wall_stiffness(cut, middle=middle, poissons_ratio=poissons_ratio, rtol=RTOL)
    thick = (upper - lower) * resolution
    transverse = np.array([periodic[4, 4], periodic[3, 3]])
    return WallRatios(
        solid=float(cut.sum() / cut[:, :, 0].size / thick / whole),
        membrane=np.diag(wall.membrane) / (thick * np.diag(plane)),
        bending=np.diag(wall.bending) / (thick**3 / 12 * np.diag(plane)),
        shear=wall.shear / (_UNIFORM_SHEAR * thick * transverse),
    )


@lru_cache(maxsize=32)
def _periodic(
    cell: Cell,
    level: float,
    axis: int,
    resolution: int,
    poissons_ratio: float,
) -> tuple[float, FloatArray]:
    """Density and stiffness of the periodic lattice on the same voxels, in the wall's axes."""
    top = float(cell.family.period)
    fill, _ = _cut_fill(cell, level, axis, 0.0, top, resolution)
    solution = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=RTOL)
    return float(fill.mean()), solution.stiffness


def _cut_fill(
    cell: Cell,
    level: float,
    axis: int,
    lower: float,
    upper: float,
    resolution: int,
) -> tuple[FloatArray, float]:
    """Fill of a slab across an axis, which becomes the last, and the height of its middle.

    Voxels that a face cuts are sampled in the slab only, and filled in proportion.
    """
    first = int(np.floor(lower * resolution + 1e-9))
    last = int(np.ceil(upper * resolution - 1e-9))
    edges = np.clip(np.arange(first, last + 1), lower * resolution, upper * resolution)
    step = (np.arange(SUBSAMPLES) + 0.5) / SUBSAMPLES
    height = (edges[:-1, None] + step * np.diff(edges)[:, None]).ravel() / resolution
    n = cell.family.period * resolution
    along = (np.arange(n * SUBSAMPLES) + 0.5) / (SUBSAMPLES * resolution)
    local = np.meshgrid(along, along, height, indexing="ij")
    # Local axes follow the normal in the cycle: the last one is the normal itself.
    u = np.stack([local[(i - axis - 1) % 3] for i in range(3)])
    solid = evaluate_shape(cell.family, cell.parameters, u) <= level
    shape = (n, SUBSAMPLES, n, SUBSAMPLES, last - first, SUBSAMPLES)
    fill = solid.reshape(shape).mean(axis=(1, 3, 5)) * np.diff(edges)
    return fill, 0.5 * (lower + upper) * resolution - first
