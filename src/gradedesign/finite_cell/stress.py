"""Points of the solid, von Mises stress, and displacement at points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.finite_cell import _stress_kernels as kernels
from gradedesign.finite_cell.elements import BLOCKS, Elements, element_volumes
from gradedesign.finite_cell.space import BrickSpace
from gradedesign.finite_cell.surface import reference_of


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


def solid_points(elements: Elements, most: int | None = None) -> SolidPoints:
    """Sample points of stress, with the volume that each point stands for.

    Parameters
    ----------
    elements : Elements
    most : int, optional
        Take evenly spaced ones, so many at most; each still has its own volume only.
    """
    parts, whole = BLOCKS**3, elements.whole
    side = (np.arange(BLOCKS) + 0.5) / BLOCKS
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    middle = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    share = np.concatenate(
        [np.full(whole * parts, 1.0 / parts, np.float32), elements.share.ravel()]
    )
    used = np.flatnonzero(share > 1e-9)
    if most is not None:
        used = used[:: max(1, -(-used.size // most))]
    share = share[used]
    element, part = np.divmod(used, parts)
    reference = middle[part]
    cut = element >= whole
    reference[cut] = elements.centre.reshape(-1, 3)[used[cut] - whole * parts]
    reference = np.ascontiguousarray(reference.T)
    grid = elements.grid
    within = elements.position[element].T + elements.size[element] * reference
    points = grid.lower[:, None] + grid.edges[:, None] * within
    volume = element_volumes(elements)[element] * share
    return SolidPoints(points=points, volume=volume, element=element, reference=reference)


def select_points(at: SolidPoints, chosen: slice | IntArray) -> SolidPoints:
    """Some of the points."""
    return SolidPoints(
        points=at.points[:, chosen],
        volume=at.volume[chosen],
        element=at.element[chosen],
        reference=at.reference[:, chosen],
    )


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
    reference = reference_of(elements, element, points)
    kernels.displacement_in_elements(space.nodes, u, element, reference, values)
    return values
