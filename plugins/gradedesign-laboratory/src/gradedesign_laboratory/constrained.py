"""Equilibrium of voxels with some nodal displacements held: blocks that do not repeat.

The block lies in a periodic grid with at least one layer of void behind it in every direction, so
that its opposite faces share no node and the periodic product is that of the block alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from gradedesign import SolverError
from gradedesign.fields import BoolArray, FloatArray
from gradedesign.properties import (
    VoxelOperator,
    homogeneous_inverse,
    node_scale,
    precondition,
    threads_for,
    voxel_operator,
)

#: Conjugate gradient iterations after which a solve is given up. Ends a solve that would not
#: converge. Chosen, not measured.
_MOST_ITERATIONS = 3000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Block:
    """A finite block of voxels in its padded grid.

    Attributes
    ----------
    shape : (int, int, int)
        Of the block; its nodes are one more along every axis.
    operator : VoxelOperator
        Of the padded grid.
    inverse : (6, n) float32 array
        Of the full padded grid.
    """

    shape: tuple[int, int, int]
    operator: VoxelOperator
    inverse: NDArray[np.float32]

    @property
    def volume(self) -> int:
        """Voxels of the block, void included."""
        return int(np.prod(self.shape))


def padded_block(fill: FloatArray, poissons_ratio: float) -> Block:
    """Put a block ``(nx, ny, nz)`` into a grid with void behind it."""
    values = np.asarray(fill, dtype=np.float64)
    if values.ndim != 3 or not (values > 0).any():
        raise SolverError(
            f"a fill of shape {values.shape} with {np.count_nonzero(values > 0)} solid voxels is "
            f"no block; expected (nx, ny, nz) with some solid"
        )
    size = [scipy.fft.next_fast_len(n + 1, real=True) for n in values.shape]
    padded = np.pad(values, [(0, s - n) for s, n in zip(size, values.shape, strict=True)])
    operator = voxel_operator(padded, poissons_ratio)
    with threads_for(padded.size):
        inverse = homogeneous_inverse(padded.shape, poissons_ratio)
    return Block(
        shape=(values.shape[0], values.shape[1], values.shape[2]),
        operator=operator,
        inverse=inverse,
    )


def block_nodes(block: Block) -> FloatArray:
    """Coordinates ``(3, px, py, pz)`` of the padded grid's nodes, in voxel edges."""
    axes = [np.arange(n, dtype=np.float64) for n in block.operator.fill.shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"))


def solve_held(
    block: Block,
    load: FloatArray,
    free: BoolArray,
    *,
    rtol: float,
) -> tuple[FloatArray, int, float]:
    """Solve ``K x = -load`` on the free components, with zero on the others.

    Parameters
    ----------
    load : (3, px, py, pz) array
    free : (3, px, py, pz) bool array
    rtol : float
        Norm of the residual force over that of the load, on the free components.

    Returns
    -------
    x : (3, px, py, pz) array

    Raises
    ------
    SolverError
        If the iteration does not converge.

    Notes
    -----
    Conjugate gradients, preconditioned by the periodic inverse of the full grid between two
    projections on the free components. What may move rigidly does no harm: the loads of uniform
    stress are in balance on every disconnected component.
    """
    with threads_for(load[0].size):
        return _iterate(block, load, free, rtol)


def _iterate(
    block: Block, load: FloatArray, free: BoolArray, rtol: float
) -> tuple[FloatArray, int, float]:
    """Iterate."""
    scale = np.where(free, node_scale(block.operator.fill), np.float32(0.0))
    r = np.where(free & (scale > 0), -load, 0.0)
    x, p, y = np.zeros_like(r), np.zeros_like(r), np.zeros_like(r)
    size = float(np.linalg.norm(r))
    if size <= 1e-12 * np.sqrt(load.size):
        return x, 0, 0.0
    before, reached = np.inf, 1.0
    for iteration in range(1, _MOST_ITERATIONS + 1):
        z = scale * precondition((scale * r).astype(np.float32), block.inverse)
        now = float(np.vdot(r, z))
        p *= now / before
        p += z
        before = now
        block.operator.product(p, y)
        y[scale == 0] = 0.0
        step = now / float(np.vdot(p, y))
        x += step * p
        r -= step * y
        reached = float(np.linalg.norm(r)) / size
        if reached < rtol:
            return x, iteration, reached
    raise SolverError(
        f"the block's equilibrium stopped after {_MOST_ITERATIONS} iterations at a residual of "
        f"{reached:.2e}, expected {rtol:g}; take fewer voxels, or fill the void a little"
    )
