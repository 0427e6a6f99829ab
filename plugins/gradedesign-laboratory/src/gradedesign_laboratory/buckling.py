"""Linear elastic buckling of a periodic cell under a macroscopic stress.

The cell's own stress field under the macroscopic stress weakens it in proportion; where the weaker
cell has a displacement without resistance, it buckles. Displacements repeat after one cell, or
after several where the cell is repeated: waves longer than that are not seen.
"""

from __future__ import annotations

import numpy as np

from gradedesign import (
    EigenProblem,
    EigenSolver,
    ExtremeValue,
)
from gradedesign.fields import BoolArray, FloatArray
from gradedesign.properties import PeriodicSolution, conjugate_gradients, local_stress, threads_for
from gradedesign_laboratory.alternating import (
    REPEATED,
    Signs,
    alternating_inverse,
    alternating_operator,
    alternating_phase,
    extended,
    folded,
    padded_by,
)
from gradedesign_laboratory.extreme_values import extreme_values
from gradedesign_laboratory.lanczos import LANCZOS

#: Residual of the solves inside the eigenvalue iteration. Chosen, not measured.
_SOLVE_RTOL = 1e-5
#: A stress that buckles a grid only at its reverse's load over this is not followed further where
#: both are looked at, and does not buckle it at all where it is the only one. Chosen, not measured.
NEGLIGIBLE = 0.15
#: The same where only one of both is looked at, so that loads a hundred times the reverse's are
#: still followed. Chosen, not measured.
_NEVER = 0.01


def macro_prestress(solution: PeriodicSolution, macro_stress: FloatArray) -> FloatArray:
    """Stress ``(6, nx, ny, nz)`` of every voxel under a macroscopic Voigt stress ``(6,)``."""
    field = local_stress(solution)
    stress = np.zeros((6, solution.fill.size))
    solid = np.flatnonzero(solution.fill)
    # The base material's stress times the fill is the voxel's.
    stress[:, solid] = np.tensordot(field.stress, macro_stress, axes=(1, 0)) * field.volume
    return stress.reshape(6, *solution.fill.shape)


def weakest_modes(
    fill: FloatArray,
    stress: FloatArray,
    *,
    poissons_ratio: float,
    start: FloatArray,
    signs: Signs = REPEATED,
    both: bool,
    solver: EigenSolver = LANCZOS,
) -> tuple[ExtremeValue, ExtremeValue | None]:
    """Modes in which a field of stress, and that field reversed, buckle a grid first.

    Parameters
    ----------
    fill : (nx, ny, nz) array
    stress : (6, nx, ny, nz) array
    start : (3, nx, ny, nz) array
        Of the iteration.
    signs : (int, int, int)
        Of the modes from each cell to the next.
    both : bool
        Look at the reversed stress too.

    Returns
    -------
    tuple of ExtremeValue
        One over the load factor for the stress, and minus that for the stress reversed or None.
        With both, a field that buckles the grid only at seven times the load of its reverse has
        the value zero, with one over that load as its bound.

    Raises
    ------
    SolverError
        If the iteration does not converge.
    """
    shape = (3, *fill.shape)
    operator = alternating_operator(fill, poissons_ratio, signs)
    active = np.zeros(fill.shape, dtype=bool)
    for corner in np.ndindex(2, 2, 2):
        active |= np.roll(fill > 0, corner, (0, 1, 2))
    padded = padded_by(stress, signs)

    def without_mean(x: FloatArray) -> FloatArray:
        # A grid that repeats can drift as a whole.
        return x - _mean(x, active) if signs == REPEATED else x

    def solve(force: FloatArray) -> FloatArray:
        x = np.zeros(shape)
        load = -np.where(active, without_mean(force.reshape(shape)), 0.0)
        conjugate_gradients(operator, inverse, load, x, _SOLVE_RTOL, 1000, 0, phase)
        return np.where(active, without_mean(x), 0.0).ravel()

    def weakening(x: FloatArray) -> FloatArray:
        product = geometric_product(padded, extended(x.reshape(shape), signs))
        return -folded(product, signs).ravel()

    def stiffness(x: FloatArray) -> FloatArray:
        product = np.zeros(shape)
        operator.product(x.reshape(shape), product)
        return product.ravel()

    with threads_for(fill.size):
        inverse = alternating_inverse(fill.shape, poissons_ratio, signs)
        phase = alternating_phase(fill.shape, signs)
        return extreme_values(
            solver,
            EigenProblem(
                form=weakening,
                stiffness=stiffness,
                solve=solve,
                start=np.where(active, start, 0.0).ravel(),
                both=both,
                negligible=NEGLIGIBLE if both else _NEVER,
            ),
        )


def geometric_product(stress: FloatArray, u: FloatArray) -> FloatArray:
    """Product of nodal displacements with the geometric stiffness of stressed voxels of edge 1.

    Parameters
    ----------
    stress : (6, nx, ny, nz) array
        Uniform in each voxel.
    u : (3, nx, ny, nz) array
        Periodic.

    Returns
    -------
    (3, nx, ny, nz) array
        Forces whose energy is ``1/2 stress_kl integral d_k u_i d_l u_i`` over all voxels.
    """
    xx, yy, zz, yz, xz, xy = stress / 16
    result = np.zeros_like(u)
    for c in range(3):
        # Amplitudes of the products of 1 and 2 xi - 1; x counts 4, y counts 2, z counts 1.
        m = _modes(u[c])
        force = [
            np.zeros_like(xx),
            zz * m[1] + yz * m[2] + xz * m[4],
            yy * m[2] + yz * m[1] + xy * m[4],
            ((yy + zz) * m[3] + xy * m[5] + xz * m[6]) / 3,
            xx * m[4] + xy * m[2] + xz * m[1],
            ((xx + zz) * m[5] + xy * m[3] + yz * m[6]) / 3,
            ((xx + yy) * m[6] + xz * m[3] + yz * m[5]) / 3,
            (xx + yy + zz) * m[7] / 9,
        ]
        result[c] = _forces(force)
    return result


def _modes(u: FloatArray) -> list[FloatArray]:
    """Eight times the amplitudes of the modes of every voxel."""
    modes = [u]
    for axis in range(3):
        ahead = [np.roll(m, -1, axis) for m in modes]
        modes = [v for m, a in zip(modes, ahead, strict=True) for v in (a + m, a - m)]
    return modes


def _forces(modes: list[FloatArray]) -> FloatArray:
    """Transpose of `_modes`."""
    for axis in (2, 1, 0):
        modes = [
            np.roll(even + odd, 1, axis) + even - odd
            for even, odd in zip(modes[0::2], modes[1::2], strict=True)
        ]
    return modes[0]


def _mean(x: FloatArray, active: BoolArray) -> FloatArray:
    """Mean of each component over the nodes of the solid, ``(3, 1, 1, 1)``."""
    mean = (x * active).sum(axis=(1, 2, 3), keepdims=True) / np.count_nonzero(active)
    return np.asarray(mean)
