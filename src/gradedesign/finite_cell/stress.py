"""Strain and stress in the solid, and displacement at points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.finite_cell.basis import gradients_at, shapes_at
from gradedesign.finite_cell.elements import BLOCKS, Elements
from gradedesign.finite_cell.space import BrickSpace
from gradedesign.finite_cell.surface import reference_of

#: Points worked on at once.
CHUNK = 2**15


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidPoints:
    """Centroids of the solid in every sub-cell of every element.

    Attributes
    ----------
    points : (3, m) array, mm
    volume : (m,) array, mm^3
    element : (m,) int array
    reference : (3, m) array
    """

    points: FloatArray
    volume: FloatArray
    element: IntArray
    reference: FloatArray


def solid_points(elements: Elements) -> SolidPoints:
    """Where stress is reported, with the volume that each point stands for."""
    count, parts = len(elements.position), BLOCKS**3
    side = (np.arange(BLOCKS) + 0.5) / BLOCKS
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    middle = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    reference = np.concatenate([np.tile(middle, (elements.whole, 1, 1)), elements.centre])
    share = np.concatenate([np.full((elements.whole, parts), 1.0 / parts), elements.share])
    used = share.ravel() > 1e-9
    element = np.repeat(np.arange(count), parts)[used]
    reference = np.ascontiguousarray(reference.reshape(-1, 3)[used].T, dtype=np.float64)
    grid = elements.grid
    points = grid.lower[:, None] + grid.edges[:, None] * (elements.position[element].T + reference)
    volume = float(np.prod(grid.edges)) * share.ravel()[used]
    return SolidPoints(points=points, volume=volume, element=element, reference=reference)


def select_points(at: SolidPoints, chosen: slice | IntArray) -> SolidPoints:
    """Some of the points."""
    return SolidPoints(
        points=at.points[:, chosen],
        volume=at.volume[chosen],
        element=at.element[chosen],
        reference=at.reference[:, chosen],
    )


def stress_at(
    elements: Elements,
    space: BrickSpace,
    u: FloatArray,
    lame: tuple[float, float],
    at: SolidPoints,
    thermal_strain: float = 0.0,
) -> FloatArray:
    """Cauchy stress at points of the solid, ``(3, 3, m)``, MPa.

    Parameters
    ----------
    elements : Elements
    space : BrickSpace
    u : (N, 3) array, mm
    lame : (float, float), MPa
    at : SolidPoints
    thermal_strain : float
        Free expansion, subtracted from the strain.
    """
    first, shear = lame
    stress = np.zeros((3, 3, at.volume.size))
    for k in range(0, at.volume.size, CHUNK):
        part = slice(k, k + CHUNK)
        gradients = gradients_at(at.reference[:, part], elements.grid.edges)
        own = u[space.nodes[at.element[part]]]
        slope = np.einsum("mda,mac->cdm", gradients, own, optimize=True)
        strain = (slope + np.swapaxes(slope, 0, 1)) / 2.0
        strain[range(3), range(3)] -= thermal_strain
        stress[:, :, part] = 2.0 * shear * strain
        stress[range(3), range(3), part] += first * np.einsum("ccm->m", strain)
    return stress


def von_mises(stress: FloatArray) -> FloatArray:
    """Von Mises stress of ``(3, 3, ...)``, ``(...)``, MPa."""
    deviator = stress - np.einsum("cc...->...", stress) / 3.0 * np.eye(3).reshape(
        3, 3, *[1] * (stress.ndim - 2)
    )
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def displacement_at(
    elements: Elements, space: BrickSpace, u: FloatArray, element: IntArray, points: FloatArray
) -> FloatArray:
    """Displacement at points ``(3, m)`` in given elements, ``(3, m)``, mm."""
    values = np.zeros(points.shape)
    for k in range(0, points.shape[1], CHUNK):
        part = slice(k, k + CHUNK)
        shapes = shapes_at(reference_of(elements, element[part], points[:, part]))
        values[:, part] = np.einsum("ma,mac->cm", shapes, u[space.nodes[element[part]]])
    return values
