"""The stiffness of a periodic grid of voxels, and the inverse of its homogeneous counterpart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.fft
from numba import get_num_threads, set_num_threads
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import SolverError
from gradedesign.mechanics.homogenise._gradient_kernels import PIECES, invert_blocks
from gradedesign.mechanics.homogenise._hexahedron_kernels import (
    SLABS,
    solid_runs,
    stiffness_product,
)

#: Voxels from which threads pay. Below, waiting for each other costs more than they save, and far
#: more when other programs keep the processors busy.
THREADED = 100_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoxelOperator:
    """Stiffness of cubic voxels of edge 1, each of Young's modulus ``fill``."""

    #: ``(nx, ny, nz)``. Young's modulus of each voxel relative to the base material, 0 to 1.
    fill: FloatArray
    poissons_ratio: float
    #: Runs of solid voxels, see the kernel.
    first: IntArray
    runs: IntArray
    seam: FloatArray  #: ``(slabs, 3, ny, nz)``. Work space of `product`.

    def product(self, u: FloatArray, y: FloatArray) -> None:
        """Set ``y = K u`` for nodal values ``(3, nx, ny, nz)``."""
        lam, mu = lame(self.poissons_ratio)
        in_ranges(
            stiffness_product, range(SLABS), u, self.fill, self.first, self.runs, lam, mu, y,
            self.seam,
        )  # fmt: skip
        nx = len(self.fill)
        for t, seam in enumerate(self.seam):
            end = (t + 1) * nx // SLABS
            if end > t * nx // SLABS:
                y[:, end % nx] += seam


class GridOperator(Protocol):
    """Stiffness of a grid, whatever holds between a cell and the next."""

    @property
    def fill(self) -> FloatArray:
        """Young's modulus of each voxel, ``(nx, ny, nz)``."""
        ...

    def product(self, u: FloatArray, y: FloatArray) -> None:
        """Set ``y = K u`` for nodal values ``(3, nx, ny, nz)``."""
        ...


@contextmanager
def threads_for(voxels: int) -> Iterator[None]:
    """Run kernels and transforms on one thread inside the block if the grid is small.

    Examples
    --------
    >>> import numba
    >>> with threads_for(64):  # a grid of 64 voxels
    ...     threads = numba.get_num_threads()
    >>> threads
    1
    """
    before = get_num_threads()
    if voxels < THREADED:
        set_num_threads(1)
    try:
        yield
    finally:
        set_num_threads(before)


def lame(poissons_ratio: float) -> tuple[float, float]:
    """Lame's constants at unit Young's modulus."""
    nu = poissons_ratio
    return nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))


def voxel_operator(fill: FloatArray, poissons_ratio: float) -> VoxelOperator:
    """Prepare the stiffness of a grid.

    Raises `SolverError` for a fill outside 0 to 1, or a Poisson ratio outside -1 to 0.5.

    ``fill (nx, ny, nz)``: 0 (void, no stiffness at all) to 1.

    Examples
    --------
    >>> voxel_operator(np.ones((4, 4, 4)), 0.3).fill.shape
    (4, 4, 4)
    """
    values = np.ascontiguousarray(fill, dtype=np.float64)
    if values.ndim != 3 or min(values.shape) < 2:
        raise SolverError(f"a fill of shape {values.shape} is no grid; expected (nx, ny, nz), >= 2")
    if not (np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1):
        raise SolverError(
            f"the fill of the voxels runs from {values.min():g} to {values.max():g}; "
            f"expected 0 (void) to 1 (solid)"
        )
    if not -1 < poissons_ratio < 0.5:
        raise SolverError(f"Poisson ratio {poissons_ratio:g} is impossible; expected -1 to 0.5")
    nx, ny, nz = values.shape
    first = np.zeros(nx * ny + 1, dtype=np.int64)
    count = solid_runs(values, first, np.zeros((0, 2), dtype=np.int64))
    runs = np.zeros((count, 2), dtype=np.int64)
    solid_runs(values, first, runs)
    return VoxelOperator(
        fill=values,
        poissons_ratio=poissons_ratio,
        first=first,
        runs=runs,
        seam=np.zeros((SLABS, 3, ny, nz)),
    )


def homogeneous_inverse(shape: tuple[int, int, int], poissons_ratio: float) -> NDArray[np.float32]:
    """Inverse of the stiffness of the full grid, one 3 by 3 block for each frequency.

    Translation invariance makes the Fourier transform diagonalise the operator of the same
    hexahedra up to 3 by 3 blocks, so that this inverse is exact where all voxels are solid and
    holds the number of iterations flat in the resolution where they are not. Returns ``(6, n)``:
    entries xx, yy, zz, yz, xz, xy for the frequencies of a real transform; zero for the mean.

    Examples
    --------
    >>> homogeneous_inverse((4, 4, 4), 0.3).shape
    (6, 48)
    """
    solid = voxel_operator(np.ones(shape), poissons_ratio)
    block = []
    for c in range(3):
        unit = np.zeros((3, *shape))
        unit[c, 0, 0, 0] = 1.0
        response = np.zeros_like(unit)
        solid.product(unit, response)
        # The stencil is even under inversion, so its transform is real.
        block.append(scipy.fft.rfftn(response, axes=(1, 2, 3), workers=get_num_threads()).real)
    return block_inverse(block, free_mean=True)


def block_inverse(block: Sequence[FloatArray], *, free_mean: bool) -> NDArray[np.float32]:
    """Inverse of the symmetric 3 by 3 blocks of a stiffness.

    ``block``: three (3, ...) arrays; columns of the block of every frequency. ``free_mean``: the
    first frequency is the mean, which meets no resistance: its inverse is set to zero. Returns
    ``(6, n)``: entries xx, yy, zz, yz, xz, xy.

    Examples
    --------
    >>> columns = [np.diag([2.0, 4.0, 5.0])[k, :, None] for k in range(3)]
    >>> inverse = block_inverse(columns, free_mean=False)
    >>> [round(float(entry), 3) for entry in inverse[:3, 0]]
    [0.5, 0.25, 0.2]
    """
    xx, xy, xz = block[0].reshape(3, -1)
    _, yy, yz = block[1].reshape(3, -1)
    zz = block[2][2].ravel()
    adjugate = np.stack(
        [
            yy * zz - yz**2,
            xx * zz - xz**2,
            xx * yy - xy**2,
            xy * xz - xx * yz,
            xy * yz - yy * xz,
            xz * yz - zz * xy,
        ]
    )
    determinant = xx * adjugate[0] + xy * adjugate[5] + xz * adjugate[4]
    if free_mean:
        determinant[0] = np.inf
    return (adjugate / determinant).astype(np.float32)


def node_scale(fill: FloatArray) -> NDArray[np.float32]:
    """Scale of every node before and after the homogeneous inverse, zero in the void.

    One where every voxel is solid or void. Partly filled voxels slow the plain inverse down (60
    iterations to 1e-4 with a least fill of 1/27, 80 with 1/64); the mean fill to the power -1/4,
    half way to scaling by the diagonal, takes 20 to 30. Measured for sheets and networks at
    densities 0.12 to 0.3; with solid and void alone it takes a third more than no scale.

    Examples
    --------
    >>> float(node_scale(np.ones((4, 4, 4))).min())
    1.0
    """
    mean = 0.125 * fill
    for axis in range(3):
        mean = mean + np.roll(mean, 1, axis)
    scale = np.zeros(fill.shape)
    power = -0.25 if ((fill > 0) & (fill < 1)).any() else 0.0
    np.power(mean, power, out=scale, where=mean > 0)
    return scale.astype(np.float32)


def precondition(
    rough: NDArray[np.float32],
    inverse: NDArray[np.float32],
    phase: NDArray[np.complex64] | None = None,
) -> NDArray[np.floating[Any]]:
    """Apply `homogeneous_inverse` to nodal forces ``(3, nx, ny, nz)`` in single precision.

    With a phase, `alternating_inverse` is applied to forces that the phase makes periodic.

    Examples
    --------
    >>> inverse = homogeneous_inverse((4, 4, 4), 0.3)
    >>> precondition(np.zeros((3, 4, 4, 4), np.float32), inverse).shape
    (3, 4, 4, 4)
    """
    if phase is not None:
        turned = scipy.fft.fftn(rough * phase, axes=(1, 2, 3), workers=get_num_threads())
        in_ranges(invert_blocks, range(PIECES), turned.reshape(3, -1), inverse)
        back = scipy.fft.ifftn(turned, axes=(1, 2, 3), workers=get_num_threads(), overwrite_x=True)
        real: NDArray[np.floating[Any]] = (back * phase.conj()).real
        return np.ascontiguousarray(real)
    spectrum = scipy.fft.rfftn(rough, axes=(1, 2, 3), workers=get_num_threads())
    in_ranges(invert_blocks, range(PIECES), spectrum.reshape(3, -1), inverse)
    result: NDArray[np.floating[Any]] = scipy.fft.irfftn(
        spectrum, s=rough.shape[1:], axes=(1, 2, 3), workers=get_num_threads(), overwrite_x=True
    )
    return result
