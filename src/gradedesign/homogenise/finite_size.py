"""How blocks of few cells and walls one cell thick differ from the endless lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import SolverError
from gradedesign.homogenise.constants import engineering_constants, solid_stiffness
from gradedesign.homogenise.constrained import padded_block, solve_held
from gradedesign.homogenise.operator import homogeneous_inverse, threads_for, voxel_operator
from gradedesign.homogenise.periodic import conjugate_gradients, solve_periodic, unit_load

#: Voigt components in the plane of a wall across z.
_PLANE = (0, 1, 5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FiniteSize:
    """Stiffness of finite pieces over that of the endless lattice, on the same voxels.

    Attributes
    ----------
    counts : tuple of int
        Cells along each edge of the blocks.
    block : (k,) array
        Young's modulus along x of cubes of cells between smooth plates, their sides free.
    walls : tuple of int
        Cells across the walls.
    wall_youngs, wall_shear : (m,) array
        In the plane of the walls, their faces free.
    """

    counts: tuple[int, ...]
    block: FloatArray
    walls: tuple[int, ...]
    wall_youngs: FloatArray
    wall_shear: FloatArray


def finite_size(
    fill: FloatArray,
    counts: Sequence[int] = (1, 2, 3),
    *,
    walls: Sequence[int] = (1,),
    poissons_ratio: float = 0.3,
    rtol: float = 1e-3,
) -> FiniteSize:
    """Compare blocks and walls of a cell with its periodic stiffness.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        One cell, cut where the block's faces are to lie.
    counts : sequence of int
        Cells along each edge of the blocks.
    walls : sequence of int
        Cells across the walls.
    poissons_ratio : float
    rtol : float
        Of the solves; ratios are right to its square.

    Returns
    -------
    FiniteSize

    Raises
    ------
    LatticeError, SolverError
        As `solve_periodic`; also if a block hangs together by nothing, so that a solve fails.
    """
    endless = solve_periodic(fill, poissons_ratio=poissons_ratio, rtol=rtol).stiffness
    youngs = engineering_constants(endless).youngs[0]
    plane = np.linalg.inv(np.linalg.inv(endless)[np.ix_(_PLANE, _PLANE)])
    wall = [
        wall_stiffness(np.tile(fill, (1, 1, n)), poissons_ratio=poissons_ratio, rtol=rtol)
        for n in walls
    ]
    compliance = np.linalg.inv(plane)[0, 0]
    return FiniteSize(
        counts=tuple(counts),
        block=np.array(
            [
                block_youngs(np.tile(fill, (n, n, n)), poissons_ratio=poissons_ratio, rtol=rtol)
                for n in counts
            ]
        )
        / youngs,
        walls=tuple(walls),
        wall_youngs=np.array([compliance / np.linalg.inv(w)[0, 0] for w in wall]),
        wall_shear=np.array([w[2, 2] / plane[2, 2] for w in wall]),
    )


def block_youngs(fill: FloatArray, *, poissons_ratio: float = 0.3, rtol: float = 1e-3) -> float:
    """Young's modulus along x of a block between smooth plates, its sides free.

    Parameters
    ----------
    fill : (nx, ny, nz) array
    poissons_ratio : float
    rtol : float

    Returns
    -------
    float
        Over the base material's.

    Raises
    ------
    SolverError
        If the solve does not converge.
    """
    block = padded_block(fill, poissons_ratio)
    load = unit_load(block.operator, 0)
    free = np.ones(load.shape, dtype=bool)
    free[0, 0] = free[0, block.shape[0]] = False
    u, _, _ = solve_held(block, load, free, rtol=rtol, max_iterations=5000)
    y = np.zeros_like(u)
    block.operator.product(u, y)
    solid = solid_stiffness(poissons_ratio)[0, 0] * block.operator.fill.sum()
    energy = solid + np.vdot(u, y) + 2 * np.vdot(load, u)
    return float(energy / block.volume)


def wall_stiffness(
    fill: FloatArray, *, poissons_ratio: float = 0.3, rtol: float = 1e-3
) -> FloatArray:
    """Stiffness in its plane of a wall across z that repeats along x and y, its faces free.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        One period, the whole thickness.
    poissons_ratio : float
    rtol : float

    Returns
    -------
    (3, 3) array
        For xx, yy, xy with engineering shear, per thickness, over the base material's modulus.

    Raises
    ------
    SolverError
        If a solve does not converge.
    """
    if min(fill.shape) < 2:
        raise SolverError(f"a wall of {fill.shape} voxels is too small; expected 2 or more")
    # A layer of void keeps the faces apart; two where that suits the transform.
    gap = 2 if fill.shape[2] % 2 == 0 else 1
    operator = voxel_operator(np.pad(fill, ((0, 0), (0, 0), (0, gap))), poissons_ratio)
    u = np.zeros((3, 3, *operator.fill.shape))
    loads = [unit_load(operator, case) for case in _PLANE]
    with threads_for(operator.fill.size):
        inverse = homogeneous_inverse(operator.fill.shape, poissons_ratio)
        for k, load in enumerate(loads):
            conjugate_gradients(operator, inverse, load, u[k], rtol, 5000, _PLANE[k])
        y = np.zeros_like(u[0])
        stiffness = fill.sum() * solid_stiffness(poissons_ratio)[np.ix_(_PLANE, _PLANE)]
        for b in range(3):
            operator.product(u[b], y)
            for a in range(3):
                stiffness[a, b] += np.vdot(u[a], y)
                stiffness[a, b] += np.vdot(u[a], loads[b]) + np.vdot(u[b], loads[a])
    return np.asarray(0.5 * (stiffness + stiffness.T) / fill.size)
