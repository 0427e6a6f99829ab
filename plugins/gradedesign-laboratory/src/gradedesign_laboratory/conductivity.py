"""Effective conductivity of a periodic cell: heat, current or diffusion through its solid.

Trilinear voxels and conjugate gradients preconditioned by the transform of the homogeneous
operator, as for the stiffness, with one unknown per node instead of three.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy.fft

from gradedesign import SolverError
from gradedesign.fields import FloatArray
from gradedesign.properties import Cell, cell_fill, connected_fill

#: Conjugate gradient iterations after which a solve is given up.
_MOST_ITERATIONS = 1000


def cell_conductivity(fill: FloatArray, *, rtol: float = 1e-6) -> FloatArray:
    """Conductivity of a periodic grid of voxels, the void insulating.

    Parameters
    ----------
    fill : (nx, ny, nz) array
        Conductivity of each cubic voxel relative to the base material, 0 to 1.
    rtol : float
        Norm of the residual over that of the load; the result is right to its square.

    Returns
    -------
    (3, 3) array
        Relative to the base material.

    Raises
    ------
    LatticeError
        If the solid does not connect the cell to its neighbours in three directions.
    SolverError
        If the iteration does not converge.
    """
    connected, _ = connected_fill(fill)
    inverse = _homogeneous_inverse(connected.shape)
    loads = [_unit_load(connected, axis) for axis in range(3)]
    states = [_solve(connected, inverse, load, rtol) for load in loads]
    conductivity = connected.mean() * np.eye(3)
    for a, b in product(range(3), repeat=2):
        energy = np.vdot(states[a], _product(connected, states[b]))
        mixed = np.vdot(states[a], loads[b]) + np.vdot(states[b], loads[a])
        conductivity[a, b] += (energy + mixed) / connected.size
    return np.asarray(0.5 * (conductivity + conductivity.T))


def extrapolated_conductivity(cell: Cell, rho: float, resolution: int) -> tuple[FloatArray, float]:
    """Conductivity ``(3, 3)`` of a cell from filled voxels of two grids, and its relative error.

    Parameters
    ----------
    rho : float
        Relative density.
    resolution : int
        Even; the other grid has half of it.

    Raises
    ------
    DensityError
        If the cell does not exist at this density.
    LatticeError, SolverError
        As `cell_conductivity`.
    """
    coarse, fine = (
        cell_conductivity(cell_fill(cell, rho, n), rtol=1e-3) for n in (resolution // 2, resolution)
    )
    correction = (fine - coarse) / 3
    result = fine + correction
    return result, float(np.linalg.norm(correction) / np.linalg.norm(result))


def conductivity_bound(rho: float) -> float:
    """Largest conductivity of an isotropic solid with insulating voids, over the solid's.

    Partly filled voxels, which are no such solid, can lie a little above it.

    References
    ----------
    Z. Hashin, S. Shtrikman, J. Appl. Phys. 33 (1962) 3125.
    """
    return 2 * rho / (3 - rho)


def _product(fill: FloatArray, u: FloatArray) -> FloatArray:
    """Conductance of trilinear voxels of edge 1 times nodal values, ``(nx, ny, nz)``.

    In products of 1 and ``2 xi - 1`` along each axis the energy of a voxel is diagonal: a slope
    weighs 1, and 1/3 for each other axis along which it varies.
    """
    result = np.zeros_like(u)
    for slopes in product((0, 1), repeat=3):
        degree = sum(slopes)
        if degree == 0:
            continue
        # Each of the mode's axes contributes a gradient that varies along the others.
        weight = degree / 3.0 ** (degree - 1) / 16
        mode = u
        for axis, slope in enumerate(slopes):
            ahead = np.roll(mode, -1, axis)
            mode = ahead - mode if slope else ahead + mode
        mode = weight * fill * mode
        for axis, slope in enumerate(slopes):
            behind = np.roll(mode, 1, axis)
            mode = behind - mode if slope else behind + mode
        result += mode
    return result


def _unit_load(fill: FloatArray, axis: int) -> FloatArray:
    """Nodal fluxes that a unit temperature gradient in the homogeneous cell leaves unbalanced."""
    flux = 0.25 * fill
    for d in range(3):
        behind = np.roll(flux, 1, d)
        flux = behind - flux if d == axis else behind + flux
    return np.asarray(flux)


def _homogeneous_inverse(shape: tuple[int, ...]) -> FloatArray:
    """Inverse of the full grid's conductance for every frequency, zero for the mean."""
    unit = np.zeros(shape)
    unit[0, 0, 0] = 1.0
    symbol = scipy.fft.rfftn(_product(np.ones(shape), unit)).real
    symbol[0, 0, 0] = np.inf
    return np.asarray(1 / symbol)


def _solve(fill: FloatArray, inverse: FloatArray, load: FloatArray, rtol: float) -> FloatArray:
    """Solve ``K x = -load``."""
    mean = fill
    for axis in range(3):
        mean = 0.5 * (mean + np.roll(mean, 1, axis))
    partial = bool(((fill > 0) & (fill < 1)).any())
    scale = np.zeros_like(fill)
    np.power(mean, -0.25 if partial else 0.0, out=scale, where=mean > 0)
    r, x, p = -load, np.zeros_like(load), np.zeros_like(load)
    size = float(np.linalg.norm(load))
    if size <= 1e-12 * np.sqrt(load.size):
        return x
    before, reached = np.inf, 1.0
    for _ in range(_MOST_ITERATIONS):
        z = scale * scipy.fft.irfftn(inverse * scipy.fft.rfftn(scale * r), s=r.shape)
        now = float(np.vdot(r, z))
        p = z + now / before * p
        before = now
        y = _product(fill, p)
        step = now / float(np.vdot(p, y))
        x += step * p
        r -= step * y
        reached = float(np.linalg.norm(r)) / size
        if reached < rtol:
            return x
    raise SolverError(
        f"the conduction stopped after {_MOST_ITERATIONS} iterations at a residual of "
        f"{reached:.2e}, expected {rtol:g}; take more voxels or a higher density"
    )
