"""Stiffness of a block of cells with free sides, compressed between solid plates."""

from __future__ import annotations

import numpy as np

from gradedesign.fields import FloatArray
from gradedesign.properties import (
    Cell,
    cell_fill,
    solid_stiffness,
    solve_periodic,
    unit_load,
    youngs_along,
)
from gradedesign_laboratory.constrained import padded_block, solve_held

#: Voxels along a cell, of two grids whose ratios are extrapolated: what plates hold is off by the
#: edge of a voxel. 3^3 cells by pairs of 16, 24, 32 and 40: bcc at 0.3 gives 1.438, 1.452, 1.436
#: (1.370 on the last grid itself), octet at 0.2 1.141, 1.113, 1.116.
VOXELS = (24, 32)
#: Residual force over the load; the modulus, from mean stresses, is right to as much.
_RTOL = 1e-3
_UP = np.array([0.0, 0.0, 1.0])


def compressed_modulus(
    fill: FloatArray, *, poissons_ratio: float = 0.3, rtol: float = _RTOL
) -> float:
    """Modulus of a block along z whose ends are bonded to rigid plates and whose sides are free.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        Young's modulus of each cubic voxel relative to the base material, 0 to 1.

    Returns
    -------
    float
        Mean stress over the strain between the plates, relative to the base material's modulus.

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
    # The sides carry nothing, so that the mean stress is the force on a plate over its area.
    solid = float(block.operator.fill.sum()) / block.volume
    own = solid * float(solid_stiffness(poissons_ratio)[2, 2])
    return own + float(np.vdot(load, displacement)) / block.volume


def compressed_ratio(
    cell: Cell,
    rho: float,
    cells: int,
    *,
    poissons_ratio: float = 0.3,
    voxels: tuple[int, int] = VOXELS,
) -> float:
    """Modulus of a block of ``cells^3`` cells between plates over that of the periodic lattice.

    Below 1 where free sides cut struts, above it where plates hold the cells at the ends.

    Raises
    ------
    SolverError, LatticeError
        As `compressed_modulus` and `solve_periodic`.
    """
    coarse, fine = (_ratio(cell, rho, cells, poissons_ratio, n) for n in voxels)
    return fine + (fine - coarse) * voxels[0] / (voxels[1] - voxels[0])


def _ratio(cell: Cell, rho: float, cells: int, poissons_ratio: float, voxels: int) -> float:
    """The ratio on one grid."""
    fill = cell_fill(cell, rho, voxels)
    periodic = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=1e-5).stiffness
    block = np.tile(fill, (cells, cells, cells))
    modulus = compressed_modulus(block, poissons_ratio=poissons_ratio)
    return modulus / float(youngs_along(periodic, _UP))
