"""Places of a divided solid at which tractions should vanish or balance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.mechanics.finite_cell.elements import BLOCKS, Elements, solid_volume
from gradedesign.mechanics.finite_cell.stress import solid_points

#: Most points of the solid that are looked at: evenly spaced ones of them all, each standing for
#: its neighbours. Chosen, not measured.
MOST = 2**16
#: Most faces of an axis, all of them up to some 14 M unknowns. With `MOST`, each for five,
#: two points below the corner of a plate were a third of a residual of `compression-block`, which
#: hardly fell on elements of two thirds: 0.0343 mm instead of 0.0233 with every second one.
MOST_OF_FACES = 2**19
#: Most points of the surface, where single slivers of solid weigh: every sixth of 10 M unknowns.
#: With `MOST`, where each stood for 46, one of them was 72 % of a residual and tripled it.
MOST_OF_SURFACE = 2**19
#: Sub-cells with less solid than the first share of theirs, or more than the second, are not cut.
#: Chosen, not measured.
_CUT = (1e-6, 1.0 - 1e-6)
#: Step of differences of the field, over the shortest edge. Chosen, not measured.
STEP = 1e-4
#: Farthest that the surface lies from the centroid of a cut sub-cell, over the longest edge.
#: Chosen, not measured.
NEAR = 0.5
#: Points along the edge of a face, and sub-cells of each.
ALONG, _OF_EACH = 2, BLOCKS // 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """Points in elements at which residuals are weighed, with weight and direction."""

    element: IntArray  #: ``(m,)``.
    reference: FloatArray  #: ``(3, m)``.
    #: ``(m,)``, mm^3. Area times half the edge of an element across it; volume of points of the
    #: solid.
    weight: FloatArray
    normal: FloatArray  #: ``(3, m)``.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResidualPlaces:
    """Sample points at which tractions of a divided solid should vanish or balance."""

    free: Places  #: On the surface of the solid.
    sides: tuple[Places, Places]  #: On faces between elements, seen from either side.
    inner: Places  #: Of the solid, for its energy.


def residual_places(elements: Elements, field: Field) -> ResidualPlaces:
    """Points at which the tractions of any solution on these elements are looked at.

    ``field``: that they were cut by.
    """
    report_step("error estimate")
    surface = _cut_surface(elements, field)
    faces, sides = _faces(elements)
    at = solid_points(elements, MOST)
    inner = Places(
        element=at.element,
        reference=at.reference,
        weight=at.volume * (solid_volume(elements) / at.volume.sum()),
        normal=np.zeros((3, at.element.size)),
    )
    return ResidualPlaces(free=_joined([surface, faces]), sides=sides, inner=inner)


def _cut_surface(elements: Elements, field: Field) -> Places:
    """Points of the surface in cut sub-cells."""
    share = elements.share * BLOCKS**3
    own, sub = np.nonzero((share > _CUT[0]) & (share < _CUT[1]))
    some = _some(own.size, MOST_OF_SURFACE)
    stands_for = own.size / max(some.size, 1)
    own, sub = own[some], sub[some]
    grid = elements.grid
    corner = grid.lower[:, None] + grid.edges[:, None] * elements.position[own + elements.whole].T
    start = corner + grid.edges[:, None] * elements.centre[own, sub].T
    points, normal = start, np.zeros_like(start)
    for _ in range(2):
        value, normal = _value_and_gradient(field, points, STEP * float(grid.edges.min()))
        square = (normal**2).sum(axis=0)
        points = (
            points
            - np.where(square > 0.0, value / np.where(square > 0.0, square, 1.0), 0.0) * normal
        )
    length = np.linalg.norm(normal, axis=0)
    near = np.linalg.norm(points - start, axis=0) < NEAR * float(grid.edges.max())
    near &= np.isfinite(length) & (length > 0.0)
    side = float(np.prod(grid.edges)) ** (1.0 / 3.0)
    weight = 0.5 * side * (side / BLOCKS) ** 2 * stands_for
    return Places(
        element=own[near] + elements.whole,
        reference=(points[:, near] - corner[:, near]) / grid.edges[:, None],
        weight=np.full(int(near.sum()), weight),
        normal=normal[:, near] / length[near],
    )


def _faces(elements: Elements) -> tuple[Places, tuple[Places, Places]]:
    """Bare faces on grid planes, and faces between elements from either side."""
    free: list[Places] = []
    here: list[Places] = []
    there: list[Places] = []
    for axis in range(3):
        solid = [_solid_beside(elements, axis, side) for side in range(2)]
        covered = [np.zeros(solid[0].shape), np.zeros(solid[0].shape)]
        for lower, upper in _neighbours(elements, axis):
            for side, a, b in ((1, lower, upper), (0, upper, lower)):
                np.maximum.at(covered[side], a, solid[1 - side][b])
            some = _some(lower.size, MOST_OF_FACES)
            stands_for = lower.size / max(some.size, 1)
            lower, upper = lower[some], upper[some]
            both: FloatArray = np.minimum(solid[1][lower], solid[0][upper]) * stands_for
            here.append(_on_face(elements, axis, 1, lower, both))
            there.append(_on_face(elements, axis, 0, upper, both))
        for side in range(2):
            bare = (solid[side] > 1.0 - 1e-3) & (covered[side] < 1e-3)
            own = np.flatnonzero(bare.any(axis=1))
            some = own[_some(own.size, MOST_OF_FACES)]
            stands_for = own.size / max(some.size, 1)
            counts: FloatArray = bare[some].astype(np.float64) * stands_for
            free.append(_on_face(elements, axis, side, some, counts))
    return _joined(free), (_joined(here), _joined(there))


def _neighbours(elements: Elements, axis: int) -> list[tuple[IntArray, IntArray]]:
    """Pairs of elements with nodes in common on a face across an axis, the lower one first."""
    shape, position = elements.grid.shape, elements.position.astype(np.int64)
    inside = np.flatnonzero(position[:, axis] + 1 < shape[axis])
    beyond = position[inside]
    beyond[:, axis] += 1
    pairs = []
    for copy in range(int(elements.copy.max(initial=0)) + 1):
        of = np.flatnonzero(elements.copy == copy)
        table = np.full(shape, -1, dtype=np.int32)
        table[tuple(position[of].T)] = of
        upper = table[tuple(beyond.T)].astype(np.int64)
        met = upper >= 0
        lower, upper = inside[met], upper[met]
        joined = (elements.faces[lower, 2 * axis + 1] & elements.faces[upper, 2 * axis]) != 0
        pairs.append((lower[joined], upper[joined]))
    return pairs


def _solid_beside(elements: Elements, axis: int, side: int) -> FloatArray:
    """Share of solid in the sub-cells next to each part of a face, ``(n, 4)``."""
    count = len(elements.position)
    share = np.ones((count, BLOCKS, BLOCKS, BLOCKS), dtype=np.float32)
    cut = elements.share.reshape(-1, BLOCKS, BLOCKS, BLOCKS) * BLOCKS**3
    share[elements.whole :] = np.minimum(cut, 1.0)
    layer = np.take(share, side * (BLOCKS - 1), axis=3 - axis)  # sub-cells are stored z, y, x
    parts = layer.reshape(count, ALONG, _OF_EACH, ALONG, _OF_EACH).mean(axis=(2, 4))
    return np.asarray(parts.reshape(count, ALONG**2), dtype=np.float64)


def _on_face(
    elements: Elements, axis: int, side: int, element: IntArray, weight: FloatArray
) -> Places:
    """Middles of the parts of faces, weighted by the share ``(k, 4)`` of each that counts."""
    edges = elements.grid.edges
    along = (np.arange(ALONG) + 0.5) / ALONG
    second, first = np.meshgrid(along, along, indexing="ij")
    across = [d for d in range(3) if d != axis]
    reference = np.zeros((3, element.size, ALONG**2))
    reference[axis] = side
    reference[across[0]], reference[across[1]] = first.ravel(), second.ravel()
    used = (weight > 0.0).ravel()
    volume = 0.5 * float(np.prod(edges)) / ALONG**2
    normal = np.zeros((3, int(used.sum())))
    normal[axis] = 1.0
    return Places(
        element=np.repeat(element, ALONG**2)[used],
        reference=np.ascontiguousarray(reference.reshape(3, -1)[:, used]),
        weight=volume * weight.ravel()[used],
        normal=normal,
    )


def _joined(parts: Sequence[Places]) -> Places:
    """Concatenate several sets of points."""
    return Places(
        element=np.concatenate([p.element for p in parts]),
        reference=np.concatenate([p.reference for p in parts], axis=1),
        weight=np.concatenate([p.weight for p in parts]),
        normal=np.concatenate([p.normal for p in parts], axis=1),
    )


def _some(count: int, most: int) -> IntArray:
    """Evenly spaced indices below a count, at most so many."""
    return np.arange(0, count, max(1, -(-count // most)))


def _value_and_gradient(
    field: Field, points: FloatArray, step: float
) -> tuple[FloatArray, FloatArray]:
    """Values ``(m,)`` of a field and its forward differences ``(3, m)``."""
    value = field(points)
    slopes = [(field(points + step * axis[:, None]) - value) / step for axis in np.eye(3)]
    return value, np.stack(slopes)
