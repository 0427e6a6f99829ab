"""Stiffness of a block of cells with free sides, compressed between its solid plates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign import DensityError
from gradedesign.fields import FloatArray
from gradedesign.properties import (
    Cell,
    cell_fill,
    solid_stiffness,
    solve_periodic,
    unit_load,
    voxels_in_wall,
    youngs_along,
)
from gradedesign_laboratory.constrained import padded_block, solve_held

#: Voxels along a cell, of pairs of grids from which both moduli are extrapolated: filled voxels
#: converge with the square of their size. The ratio by pairs of 16, 24, 32 and 40 voxels, plates of
#: 0.375 cells: 3^3 cells of octet at 0.3 1.023, 1.028, 1.025, of bcc 1.242, 1.253, 1.250, 2^3 of
#: these 1.270, 1.284, 1.280; of gyroid sheets at 0.2 by 16 and 24, 24 and 32, 36 and 48 0.931,
#: 0.923, 0.927, where walls of 0.9, 1.4 and 2.1 voxels. So the first pair is taken whose first grid
#: has `_LEAST` voxels across the thinnest wall; finer ones take minutes.
PAIRS = ((16, 24), (24, 32), (36, 48))
_LEAST = 1.0
#: Residual force over the load; the modulus, from mean stresses, is right to as much.
_RTOL = 1e-3
_UP = np.array([0.0, 0.0, 1.0])


def compressed_modulus(
    fill: FloatArray, *, poissons_ratio: float = 0.3, rtol: float = _RTOL
) -> float:
    """Modulus of a block along z whose ends are held and whose sides are free.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        Young's modulus of each cubic voxel relative to the base material, 0 to 1.

    Returns
    -------
    float
        Mean stress over the strain between its ends, relative to the base material's modulus.

    Raises
    ------
    SolverError
        If the block is empty, or the iteration does not converge.
    """
    block = padded_block(fill, poissons_ratio)
    free = np.ones((3, *block.operator.fill.shape), dtype=bool)
    free[:, :, :, [0, block.shape[2]]] = False
    load = unit_load(block.operator, 2)
    displacement, _, _ = solve_held(block, load, free, rtol=rtol)
    # The sides carry nothing, so that the mean stress is the force on an end over its area.
    solid = float(block.operator.fill.sum()) / block.volume
    own = solid * float(solid_stiffness(poissons_ratio)[2, 2])
    return own + float(np.vdot(load, displacement)) / block.volume


def compressed_ratio(
    cell: Cell,
    rho: float,
    cells: int,
    *,
    plate: float,
    poissons_ratio: float = 0.3,
    pairs: Sequence[tuple[int, int]] = PAIRS,
) -> float:
    """Modulus of a block of ``cells^3`` cells between plates over that of the periodic lattice.

    The strain is over the height of the cells, plates as rigid. Below 1 where free sides cut struts
    and feet of struts sink into the plates, above it where plates hold what would spread.

    Parameters
    ----------
    cells : int
        A multiple of the family's period.
    plate : float
        Thickness of the solid plates, cells: their outer faces are held.

    Raises
    ------
    DensityError
        If the walls are too thin for the finest pair of grids.
    SolverError, LatticeError
        As `compressed_modulus` and `solve_periodic`.
    """
    period = cell.family.period
    walls = {pair: voxels_in_wall(cell, rho, period * pair[0]) for pair in pairs}
    pair = next((pair for pair, wall in walls.items() if wall >= _LEAST), None)
    if pair is None:
        raise DensityError(
            f"cell '{cell.name}' at density {rho:g} has walls of "
            f"{max(walls.values()):.2g} voxels where a cell has {pairs[-1][0]}, too thin to "
            f"compute the modulus of a block, expected {_LEAST:g}; state a denser block"
        )
    coarse, fine = (_moduli(cell, rho, cells, plate, poissons_ratio, n) for n in pair)
    share = pair[0] ** 2 / (pair[1] ** 2 - pair[0] ** 2)
    block, periodic = fine + (fine - coarse) * share
    return float(block / periodic)


def _moduli(
    cell: Cell, rho: float, cells: int, plate: float, poissons_ratio: float, voxels: int
) -> FloatArray:
    """Modulus of the block and of the periodic lattice along z on one grid, ``(2,)``."""
    period = cell.family.period
    fill = cell_fill(cell, rho, period * voxels)
    periodic = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=1e-5).stiffness
    solid = max(round(plate * voxels), 1)
    block = np.pad(np.tile(fill, (cells // period,) * 3), ((0, 0), (0, 0), (solid, solid)))
    block[:, :, :solid] = block[:, :, -solid:] = 1.0
    modulus = compressed_modulus(block, poissons_ratio=poissons_ratio)
    modulus *= cells * voxels / block.shape[2]
    return np.array([modulus, float(youngs_along(periodic, _UP))])
