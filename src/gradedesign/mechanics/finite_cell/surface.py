"""Quadrature on the regions of a part's surface, clipped by the solid and by the elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.part.regions import Region
from gradedesign.mechanics.finite_cell._weight_kernels import RULE
from gradedesign.mechanics.finite_cell.elements import Elements
from gradedesign.mechanics.finite_cell.grid import Grid

#: How deep below a region the field is asked whether the solid reaches it, over the shortest edge
#: of an element: fields compose distances that are right to a small part of their spacing only.
DEPTH = 1e-3
#: How often a triangle on the edge of the solid is divided in four. Chosen, not measured.
DIVISIONS = 2
#: Corners of a triangle, a little towards its middle, with no area: a face that turns moves most at
#: its corner, off which the points of the rule lie by an eighth of an element.
_INWARD = 0.01
CORNERS = np.concatenate([(1.0 - _INWARD) * np.eye(3) + _INWARD / 3.0, np.zeros((3, 1))], axis=1)
#: Points per call of the field. Chosen, not measured.
POINTS = 2**18


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfacePoints:
    """Points of a region on the surface of the solid; some carry no area."""

    #: ``(3, m)``, mm and unit. Normals point out of the part.
    points: FloatArray
    normal: FloatArray
    area: FloatArray  #: ``(m,)``, mm^2.
    element: IntArray  #: ``(m,)``.
    reference: FloatArray  #: ``(3, m)``. Place in the element.


def chosen_points(at: SurfacePoints, index: IntArray) -> SurfacePoints:
    """Some of the points of a region."""
    return SurfacePoints(
        points=at.points[:, index],
        normal=at.normal[:, index],
        area=at.area[index],
        element=at.element[index],
        reference=at.reference[:, index],
    )


def element_table(elements: Elements) -> IntArray:
    """First element over every brick of the grid, ``(nx, ny, nz)``, -1 where there is none."""
    table = np.full(elements.grid.shape, -1)
    # In reverse, so that the one that was numbered first stands at last.
    order = np.argsort(-elements.copy, kind="stable")
    table[tuple(elements.position[order].T)] = order
    large = order[elements.size[order] > 1]
    for step in np.ndindex(2, 2, 2):
        table[tuple((elements.position[large] + step).T)] = large
    return table


def brick_of(grid: Grid, points: FloatArray) -> IntArray:
    """Brick of the grid that holds each point ``(3, m)``, as a flat index; -1 for none."""
    shape = np.array(grid.shape)[:, None]
    place = (points - grid.lower[:, None]) / grid.edges[:, None]
    # The far faces of the grid belong to the last bricks.
    index = np.where(place == shape, shape - 1, np.floor(place)).astype(np.int64)
    inside = ((index >= 0) & (index < shape)).all(axis=0)
    brick = np.full(points.shape[1], -1)
    brick[inside] = np.ravel_multi_index(tuple(index[:, inside]), grid.shape)
    return brick


def locate(
    elements: Elements, table: IntArray, points: FloatArray, solid: FloatArray | None = None
) -> IntArray:
    """Element that holds each point ``(3, m)``, -1 for none.

    In a brick of several elements it is the one whose solid is nearest to the point, or to another
    one in its place, ``solid`` of the same shape.
    """
    near = points if solid is None else solid
    brick = brick_of(elements.grid, points)
    element = np.where(brick >= 0, table.ravel()[brick], -1)
    further = np.flatnonzero(elements.copy)
    if not len(further):
        return element
    known_at = element >= 0
    brick[known_at] = np.ravel_multi_index(
        tuple(elements.position[element[known_at]].T), elements.grid.shape
    )
    bricks = np.ravel_multi_index(tuple(elements.position[further].T), elements.grid.shape)
    shared = np.flatnonzero((element >= 0) & np.isin(brick, bricks))
    best = _distance_in(elements, element[shared], near[:, shared])
    for number in range(1, int(elements.copy.max()) + 1):
        own = elements.copy[further] == number
        order = np.argsort(bricks[own])
        known, of = bricks[own][order], further[own][order]
        at = np.searchsorted(known, brick[shared]).clip(max=len(known) - 1)
        has = np.flatnonzero(known[at] == brick[shared])
        other = of[at[has]]
        distance = _distance_in(elements, other, near[:, shared[has]])
        nearer = distance < best[has]
        best[has[nearer]] = distance[nearer]
        element[shared[has[nearer]]] = other[nearer]
    return element


def _distance_in(elements: Elements, element: IntArray, points: FloatArray) -> FloatArray:
    """Least squared distance of points from the solid's centroids in sub-cells of cut elements."""
    distance = np.zeros(element.size)
    for k in range(0, element.size, POINTS // 64):
        part = slice(k, k + POINTS // 64)
        own = element[part] - elements.whole
        at = reference_of(elements, element[part], points[:, part]).T[:, None]
        apart = ((elements.centre[own] - at) ** 2).sum(axis=2)
        distance[part] = np.where(elements.share[own] > 0.0, apart, np.inf).min(axis=1)
    return distance


def reference_of(elements: Elements, element: IntArray, points: FloatArray) -> FloatArray:
    """Places ``(3, m)`` of points in their elements."""
    grid = elements.grid
    corner = grid.lower[:, None] + grid.edges[:, None] * elements.position[element].T
    return (points - corner) / (grid.edges[:, None] * elements.size[element])


def region_points(elements: Elements, field: Field, region: Region) -> SurfacePoints:
    """Quadrature points of a region where the solid reaches it, and corners without area.

    Raises `LatticeError` if no solid reaches the region.

    ``field``: that the elements were cut by.
    """
    grid = elements.grid
    triangles = split_by_grid(region.corners, grid.lower, grid.edges)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    solid = length > 1e-12 * float(grid.edges.min()) ** 2
    triangles, normal, length = triangles[solid], normal[solid], length[solid]
    normal /= length[:, None]
    depth = DEPTH * float(grid.edges.min())
    points, normals, areas = _clipped(field, triangles, normal, 0.5 * length, depth)
    table = element_table(elements)
    tiny = 1e-6 * float(grid.edges.min())
    element = locate(elements, table, points - tiny * normals)
    lost = element < 0
    element[lost] = locate(elements, table, points[:, lost] - depth * normals[:, lost])
    on_solid = element >= 0
    if not on_solid.any():
        raise LatticeError(
            f"region '{region.name}' carries no solid, so nothing can be held or loaded there; "
            "keep it solid with a [[keep]] table, raise the density, or let a body that was made "
            "elsewhere reach it"
        )
    element, points = element[on_solid], points[:, on_solid]
    return SurfacePoints(
        points=points,
        normal=normals[:, on_solid],
        area=areas[on_solid],
        element=element,
        reference=reference_of(elements, element, points),
    )


def split_by_grid(corners: FloatArray, lower: FloatArray, edges: FloatArray) -> FloatArray:
    """Divide triangles ``(k, 3, 3)`` until each lies in one brick, ``(m, 3, 3)``, mm."""
    triangles = (np.asarray(corners) - lower) / edges
    for axis in range(3):
        done = []
        while len(triangles):
            low, high = triangles[:, :, axis].min(axis=1), triangles[:, :, axis].max(axis=1)
            first, last = np.floor(low + 1e-9) + 1.0, np.ceil(high - 1e-9) - 1.0
            crossing = first <= last
            done.append(triangles[~crossing])
            # The middle plane first: halves keep the number of rounds small.
            plane = np.floor((first + last)[crossing] / 2.0)
            triangles = _split(triangles[crossing], axis, plane)
        triangles = np.concatenate(done)
    return triangles * edges + lower


def _split(triangles: FloatArray, axis: int, plane: FloatArray) -> FloatArray:
    """Cut triangles that cross a plane each: the lone corner's piece and two of the rest."""
    if not len(triangles):
        return triangles
    height = triangles[:, :, axis] - plane[:, None]
    above = height > 0.0
    lone = np.where(above.sum(axis=1) == 1, np.argmax(above, axis=1), np.argmin(above, axis=1))
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (lone + k) % 3] for k in range(3))
    ha, hb, hc = (height[rows, (lone + k) % 3][:, None] for k in range(3))
    ab = a + np.clip(ha / (ha - hb), 0.0, 1.0) * (b - a)
    ac = a + np.clip(ha / (ha - hc), 0.0, 1.0) * (c - a)
    ab[:, axis] = ac[:, axis] = plane
    pieces = np.concatenate([np.stack(p, axis=1) for p in ((a, ab, ac), (ab, b, c), (ab, c, ac))])
    across = np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
    return pieces[np.linalg.norm(across, axis=1) > 0.0]


def _clipped(
    field: Field, triangles: FloatArray, normal: FloatArray, area: FloatArray, depth: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points, normals and areas where the field is solid; triangles on its edge are divided."""
    points, normals, areas = [], [], []
    rule = np.concatenate([RULE, CORNERS])
    for division in range(DIVISIONS + 1):
        at = np.einsum("rc,kcd->dkr", rule[:, :3], triangles)
        inside = _inside(field, at - depth * normal.T[:, :, None])
        of_rule = inside[:, : len(RULE)]
        mixed = np.asarray(of_rule.any(axis=1) & ~of_rule.all(axis=1))
        take = inside if division == DIVISIONS else inside & ~mixed[:, None]
        points.append(at[:, take])
        normals.append(np.broadcast_to(normal.T[:, :, None], at.shape)[:, take])
        areas.append((area[:, None] * rule[:, 3])[take])
        triangles = _quartered(triangles[mixed])
        normal, area = np.repeat(normal[mixed], 4, axis=0), np.repeat(area[mixed] / 4.0, 4)
    return (
        np.concatenate(points, axis=1),
        np.concatenate(normals, axis=1),
        np.concatenate(areas),
    )


def _quartered(triangles: FloatArray) -> FloatArray:
    """Four triangles for each, in the order of the originals."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
    pieces = [np.stack(p, axis=1) for p in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.stack(pieces, axis=1).reshape(-1, 3, 3)


def _inside(field: Field, points: FloatArray) -> BoolArray:
    """Whether the field is negative at points ``(3, ...)``, in calls of bounded size."""
    flat = points.reshape(3, -1)
    inside = np.zeros(flat.shape[1], dtype=bool)
    for k in range(0, inside.size, POINTS):
        inside[k : k + POINTS] = field(flat[:, k : k + POINTS]) < 0.0
    return inside.reshape(points.shape[1:])
