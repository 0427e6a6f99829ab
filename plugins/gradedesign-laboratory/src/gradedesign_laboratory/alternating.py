"""Displacements that change sign from cell to cell, on the grid of one cell.

Every displacement that repeats after two cells along each axis is a sum of eight parts, each of
which is either repeated or reversed from one cell to the next along x, y and z. The stiffness of a
periodic cell does not mix them, so that eight problems on one cell stand for one on eight cells.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numba import get_num_threads
from numpy.typing import NDArray

from gradedesign.fields import FloatArray
from gradedesign.properties import (
    VoxelOperator,
    block_inverse,
    homogeneous_inverse,
    voxel_operator,
)

#: Along each axis 1 where the displacement repeats in the next cell, -1 where it is reversed.
Signs = tuple[int, int, int]

#: The displacement of the cell itself, which homogenisation solves.
REPEATED: Signs = (1, 1, 1)
#: All that repeat after two cells.
ALL_SIGNS: tuple[Signs, ...] = tuple((x, y, z) for x, y, z in itertools.product((1, -1), repeat=3))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlternatingOperator:
    """Stiffness of a grid for displacements of given signs.

    Attributes
    ----------
    fill : (nx, ny, nz) array
    signs : (int, int, int)
    padded : VoxelOperator
        With one layer of void behind every axis of reversal: its nodes carry the reversed values
        of the first ones.
    """

    fill: FloatArray
    signs: Signs
    padded: VoxelOperator

    def product(self, u: FloatArray, y: FloatArray) -> None:
        """Set ``y = K u`` for nodal values ``(3, nx, ny, nz)``."""
        ahead = extended(u, self.signs)
        force = np.zeros_like(ahead)
        self.padded.product(ahead, force)
        y[:] = folded(force, self.signs)


def alternating_operator(
    fill: FloatArray, poissons_ratio: float, signs: Signs
) -> AlternatingOperator:
    """Prepare the stiffness of a grid for displacements of given signs.

    Raises
    ------
    SolverError
        As `voxel_operator`.
    """
    padded = voxel_operator(padded_by(fill, signs), poissons_ratio)
    return AlternatingOperator(
        fill=np.ascontiguousarray(fill, dtype=np.float64), signs=signs, padded=padded
    )


def padded_by(field: FloatArray, signs: Signs) -> FloatArray:
    """Append a layer of zeros behind every axis of reversal; the last three axes are the grid's."""
    widths = [(0, 0)] * (field.ndim - 3) + [(0, int(sign < 0)) for sign in signs]
    return np.pad(field, widths)


def extended(u: FloatArray, signs: Signs) -> FloatArray:
    """Nodal values with the reversed first ones behind every axis of reversal."""
    for axis, sign in enumerate(signs, start=1):
        if sign < 0:
            u = np.concatenate([u, -np.take(u, [0], axis)], axis)
    return np.ascontiguousarray(u)


def folded(force: FloatArray, signs: Signs) -> FloatArray:
    """Transpose of `extended`."""
    for axis, sign in enumerate(signs, start=1):
        if sign < 0:
            count = force.shape[axis] - 1
            last = np.take(force, [count], axis)
            force = np.take(force, range(count), axis)
            first = [slice(None)] * 4
            first[axis] = slice(0, 1)
            force[tuple(first)] -= last
    return force


def alternating_phase(shape: tuple[int, int, int], signs: Signs) -> NDArray[np.complex64] | None:
    """Factor that makes values of given signs periodic, ``(nx, ny, nz)``; none if they are."""
    if signs == REPEATED:
        return None
    phase = np.ones(shape, dtype=np.complex64)
    for axis, sign in enumerate(signs):
        if sign < 0:
            n = shape[axis]
            along = np.exp(-1j * np.pi * np.arange(n) / n).astype(np.complex64)
            phase = phase * np.expand_dims(along, [a for a in range(3) if a != axis])
    return np.ascontiguousarray(phase)


def alternating_inverse(
    shape: tuple[int, int, int], poissons_ratio: float, signs: Signs
) -> NDArray[np.float32]:
    """As `homogeneous_inverse`, for displacements of given signs.

    Returns
    -------
    (6, n) float32 array
        Of all frequencies, each half a step up along the axes of reversal, where there are such
        axes; else that of `homogeneous_inverse`.
    """
    phase = alternating_phase(shape, signs)
    if phase is None:
        return homogeneous_inverse(shape, poissons_ratio)
    solid = alternating_operator(np.ones(shape), poissons_ratio, signs)
    block = []
    for c in range(3):
        unit = np.zeros((3, *shape))
        unit[c, 0, 0, 0] = 1.0
        response = np.zeros_like(unit)
        solid.product(unit, response)
        block.append(
            scipy.fft.fftn(response * phase, axes=(1, 2, 3), workers=get_num_threads()).real
        )
    return block_inverse(block, free_mean=False)
