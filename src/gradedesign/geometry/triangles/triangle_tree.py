"""Triangles in a tree of boxes: closest points, distances within a reach, and rays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gradedesign.arrays import BoolArray, FloatArray, IntArray, locked, read_only
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import MeshError
from gradedesign.geometry.triangles import _closest_kernels as kernels
from gradedesign.geometry.triangles import _ray_kernels as ray_kernels
from gradedesign.geometry.triangles import _tree_kernels as tree_kernels

#: Twice the area over the square of the longest side below which a triangle counts as flat. Chosen,
#: not measured.
FLAT = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TriangleTree:
    """Triangles sorted into a balanced binary tree of boxes."""

    #: ``(m, 9)``, mm. First corner and the two edge vectors from it, sorted by leaf.
    triangles: FloatArray
    flat: BoolArray  #: ``(m,)``. Triangles without area, sorted by leaf.
    order: IntArray  #: ``(m,)``. The triangle in each sorted place.
    box: FloatArray  #: ``(k, 6)``, mm. Lower and upper corner of every node's box.
    #: ``(k,)``. Right child (-1 in a leaf; the left child follows its parent), range of sorted
    #: places.
    right: IntArray
    first: IntArray  #: As `right`.
    count: IntArray  #: As `right`.


class ClosestPoints(NamedTuple):
    """Answer of :func:`closest_features`."""

    distance: FloatArray  #: ``(n,)``, mm.
    triangle: IntArray  #: ``(n,)``.
    point: FloatArray  #: ``(3, n)``, mm. The closest point on that triangle.
    #: ``(n,)``. Where on the triangle: 0 face; 1, 2, 3 edges 01, 12, 20; 4, 5, 6 corners 0, 1, 2.
    feature: NDArray[np.int8]


def build_triangle_tree(corners: ArrayLike) -> TriangleTree:
    """Sort triangles into a tree.

    Raises MeshError if there is no triangle. Raises ValueError if a coordinate is not finite or the
    shape is wrong.

    ``corners (m, 3 corners, 3 coordinates)``, mm.
    """
    corners = locked(corners, (None, 3, 3), name="corners")
    m = len(corners)
    if m == 0:
        raise MeshError("closest point: no triangles to search; expected at least 1")
    right, first, count = (np.zeros(2 * m, dtype=np.int64) for _ in range(3))
    nodes = tree_kernels.number_nodes(m, right, first, count)
    right, first, count = right[:nodes], first[:nodes], count[:nodes]
    order = np.arange(m, dtype=np.int64)
    centre = np.ascontiguousarray(corners.mean(axis=1).T)
    level = np.flatnonzero(right[:1] >= 0)
    while len(level):
        in_ranges(tree_kernels.halve_nodes, range(len(level)), level, first, count, centre, order)
        below = np.concatenate([level + 1, right[level]])
        level = below[right[below] >= 0]
    triangles, flat = np.zeros((m, 9)), np.zeros(m, dtype=np.bool_)
    in_ranges(tree_kernels.store_triangles, range(m), corners, order, FLAT, triangles, flat)
    box = np.zeros((nodes, 6))
    tree_kernels.fill_boxes(corners, order, right, first, count, box)
    return TriangleTree(
        triangles=triangles,
        flat=flat,
        order=order,
        box=box,
        right=right,
        first=first,
        count=count,
    )


def closest_features(tree: TriangleTree, points: FloatArray) -> ClosestPoints:
    """Closest point on the triangles, and whether it lies on a face, an edge or a corner.

    Returns ClosestPoints: the same for any number of threads. Raises ValueError if a point is not
    finite or the shape is wrong.

    ``points (3, n)``, mm.
    """
    points = _checked(points)
    n = points.shape[1]
    distance, closest = np.zeros(n), np.zeros((3, n))
    triangle, feature = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int8)
    in_ranges(
        kernels.find_closest,
        range(0, n, tree_kernels.CHUNK),
        tree.triangles,
        tree.flat,
        tree.box,
        tree.right,
        tree.first,
        tree.count,
        tree.order,
        points,
        distance,
        triangle,
        closest,
        feature,
    )
    return ClosestPoints(distance, triangle, closest, feature)


def closest_triangles(
    tree: TriangleTree, points: FloatArray
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Distance (n,) in mm, triangle index (n,) and closest point (3, n) in mm of each point."""
    distance, triangle, point, _ = closest_features(tree, points)
    return distance, triangle, point


def distance_within(tree: TriangleTree, points: FloatArray, reach: float) -> FloatArray:
    """Distance of points ``(3, n)`` to the triangles, mm, or ``reach`` beyond it, ``(n,)``.

    Raises ValueError if a point is not finite or the shape is wrong.
    """
    points = _checked(points)
    distance = np.zeros(points.shape[1])
    in_ranges(
        kernels.find_distance,
        range(0, points.shape[1], tree_kernels.CHUNK),
        tree.triangles,
        tree.flat,
        tree.box,
        tree.right,
        tree.first,
        tree.count,
        points,
        reach,
        distance,
    )
    return distance


def ray_lengths(
    tree: TriangleTree, origins: FloatArray, directions: FloatArray, way: int = 1
) -> FloatArray:
    """Lengths of rays to the first triangle that they pass through, mm, ``(n,)``.

    Infinite where there is none.

    Raises ValueError if a point is not finite or the shape is wrong.

    ``origins (3, n)``, mm. ``directions (3, n)``: of length 1. ``way``: 1 out of the solid, along a
    triangle's normal; -1 into it; 0 both.
    """
    origins, directions = _checked(origins), _checked(directions)
    lengths = np.zeros(origins.shape[1])
    in_ranges(
        ray_kernels.find_lengths,
        range(0, len(lengths), tree_kernels.CHUNK),
        tree.triangles,
        tree.box,
        tree.right,
        tree.first,
        tree.count,
        origins,
        directions,
        way,
        lengths,
    )
    return lengths


def _checked(points: FloatArray) -> FloatArray:
    """Points of shape (3, n), all finite, contiguous."""
    points = read_only(np.asarray(points, dtype=np.float64))
    if points.ndim != 2 or len(points) != 3:
        raise ValueError(f"points have shape {points.shape}, expected (3, n)")
    if not np.isfinite(points).all():
        raise ValueError(f"{np.count_nonzero(~np.isfinite(points))} coordinates are not finite")
    return points
