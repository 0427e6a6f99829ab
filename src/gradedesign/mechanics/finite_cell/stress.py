"""Points of the solid, von Mises stress, and displacement at points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.mechanics.finite_cell import _stress_kernels as kernels
from gradedesign.mechanics.finite_cell.elements import BLOCKS, Elements, element_volumes
from gradedesign.mechanics.finite_cell.space import BrickSpace
from gradedesign.mechanics.finite_cell.surface import reference_of

#: Sub-cells with a smaller share of their element's volume hold no sample point. Chosen, not
#: measured.
_LEAST_PART = 1e-9
#: Points that are worth a thread: 0.1 ms of work. Chosen, not measured.
_POINTS_A_THREAD = 1024


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidPoints:
    """Centroids of the solid in every sub-cell of every element."""

    points: FloatArray  #: ``(3, m)``, mm.
    volume: FloatArray  #: ``(m,)``, mm^3.
    element: IntArray  #: ``(m,)``.
    reference: FloatArray  #: ``(3, m)``.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidParts:
    """Sub-cells of elements that hold solid; their centroids are worked out when they are needed.

    They are some twelve times as many as elements: kept as points they took more memory than the
    displacements.
    """

    elements: Elements
    number: IntArray  #: ``(m,)``. Sub-cell of all elements, those of one element one after another.


def solid_parts(elements: Elements, most: int | None = None) -> SolidParts:
    """Sub-cells that hold solid.

    ``most``: take evenly spaced ones, so many at most.
    """
    parts = BLOCKS**3
    first, total = elements.whole * parts, len(elements.position) * parts
    held = first + np.flatnonzero(elements.share.ravel() > _LEAST_PART)
    number = np.concatenate([np.arange(first), held])
    if most is not None:
        number = number[:: max(1, -(-number.size // most))]
    return SolidParts(elements=elements, number=number.astype(np.min_scalar_type(total)))


def points_of(parts: SolidParts, chosen: slice | IntArray = slice(None)) -> SolidPoints:
    """Centroids of the solid in some sub-cells, with their volumes."""
    elements, count = parts.elements, BLOCKS**3
    number = parts.number[chosen].astype(np.int64)
    element, part = np.divmod(number, count)
    side = (np.arange(BLOCKS) + 0.5) / BLOCKS
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    middle = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    reference = middle[part]
    share = np.full(number.size, 1.0 / count, np.float32)
    cut = np.flatnonzero(element >= elements.whole)
    own = number[cut] - elements.whole * count
    reference[cut] = elements.centre.reshape(-1, 3)[own]
    share[cut] = elements.share.ravel()[own]
    reference = np.ascontiguousarray(reference.T)
    grid = elements.grid
    within = elements.position[element].T + elements.size[element] * reference
    points = grid.lower[:, None] + grid.edges[:, None] * within
    volume = element_volumes(elements)[element] * share
    return SolidPoints(points=points, volume=volume, element=element, reference=reference)


def solid_points(elements: Elements, most: int | None = None) -> SolidPoints:
    """Centroids of the solid in the sub-cells of elements, see `solid_parts` and `points_of`."""
    return points_of(solid_parts(elements, most))


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
    in_ranges(
        kernels.displacement_in_elements,
        range(0, element.size, _POINTS_A_THREAD),
        space.nodes,
        u,
        element,
        np.ascontiguousarray(reference),
        values,
    )
    return values
