"""Distance fields of a part's surface and of its regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import PartError
from gradedesign.geometry.triangles.surface_mesh import (
    SurfaceMesh,
    corner_points,
    enclosed_volume,
    open_edge_count,
)
from gradedesign.geometry.triangles.triangle_tree import (
    TriangleTree,
    build_triangle_tree,
    closest_features,
)

#: Closer to the surface, mm, its normal takes the place of the line to the closest point, whose
#: direction rounding spoils.
AT_SURFACE = 1e-6


def _angles(corners: FloatArray) -> FloatArray:
    """Angles at the corners of triangles ``(m, 3, 3)``, radian, ``(m, 3)``."""
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.arctan2(sine, (ahead * back).sum(axis=2))


def _pseudonormals(surface: SurfaceMesh) -> FloatArray:
    """Normals that give the sign of the distance at faces, edges and corners.

    ``surface``: closed and consistently oriented. Returns ``(m, 7, 3)``: by triangle and feature as
    in `triangle_tree.closest_features`: the face's normal, sums of the two faces' normals at edges
    01, 12, 20, angle-weighted sums at corners 0, 1, 2. Not of unit length.

    References
    ----------
    Baerentzen & Aanaes, "Signed distance computation using the angle weighted pseudonormal",
    IEEE Transactions on Visualization and Computer Graphics 11(3), 243-253, 2005, eq. 1.
    """
    corners = corner_points(surface)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(cross, axis=1)
    unit = cross / np.where(length > 0.0, length, 1.0)[:, None]
    table = np.zeros((len(corners), 7, 3))
    table[:, 0] = unit
    n = len(surface.vertices)
    weighted = (_angles(corners)[:, :, None] * unit[:, None, :]).reshape(-1, 3)
    flat = surface.faces.ravel()
    at_vertex = np.stack([np.bincount(flat, weighted[:, a], n) for a in range(3)], axis=1)
    table[:, 4:] = at_vertex[surface.faces]
    tail, head = surface.faces, np.roll(surface.faces, -1, axis=1)
    key = (np.minimum(tail, head) * n + np.maximum(tail, head)).ravel()
    edge = np.unique(key, return_inverse=True)[1].ravel()
    repeated = np.repeat(unit, 3, axis=0)
    at_edge = np.stack([np.bincount(edge, repeated[:, a]) for a in range(3)], axis=1)
    table[:, 1:4] = at_edge[edge].reshape(-1, 3, 3)
    return table


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurfaceDistance:
    """Exact signed distance to a closed surface; called like a function.

    Attributes
    ----------
    tree : TriangleTree
        Of its triangles.
    normals : (m, 7, 3) array
        Their `_pseudonormals`.
    """

    tree: TriangleTree
    normals: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Distances ``(...)`` mm at points ``(3, ...)`` mm, negative inside; threaded."""
        return self._nearest(points)[0].reshape(np.shape(points)[1:])

    def outward(self, points: FloatArray) -> FloatArray:
        """Unit vectors ``(3, ...)`` in which the distance grows, at points ``(3, ...)`` mm.

        Along the line to the closest point of the surface, away from the inside; at the surface
        its normal.
        """
        value, away, normal = self._nearest(points)
        along = np.where(np.abs(value) > AT_SURFACE, away * np.sign(value), normal)
        return (along / np.linalg.norm(along, axis=0)).reshape(np.shape(points))

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Signed distances, vectors from the closest points, and normals there."""
        flat = np.asarray(points, dtype=np.float64).reshape(3, -1)
        closest = closest_features(self.tree, flat)
        normal, away = self.normals[closest.triangle, closest.feature].T, flat - closest.point
        inside = np.einsum("in,in->n", away, normal) < 0.0
        return np.where(inside, -closest.distance, closest.distance), away, normal


def surface_distance(surface: SurfaceMesh) -> SurfaceDistance:
    """Exact signed distance to a closed surface, mm, negative inside, and where it grows.

    Raises PartError if the surface is empty, open or turned inside out.

    ``surface``: closed, consistently oriented, normals pointing out. Cavities are allowed.
    """
    open_edges = open_edge_count(surface)
    if len(surface.faces) == 0 or open_edges:
        raise PartError(
            f"signed distance: the surface has {len(surface.faces)} triangles and {open_edges} "
            "open or doubled edges; expected a closed, consistently oriented surface, repair it"
        )
    volume = enclosed_volume(surface)
    if volume <= 0.0:
        raise PartError(
            f"signed distance: the surface encloses {volume:.6g} mm^3; expected a positive "
            "volume, turn its triangles around"
        )
    return SurfaceDistance(
        tree=build_triangle_tree(corner_points(surface)), normals=_pseudonormals(surface)
    )


def region_distance(corners: ArrayLike) -> Field:
    """Exact distance to a set of triangles, mm, never negative.

    Returns callable: points ``(3, ...)`` in mm to distances ``(...)`` in mm; threaded. Raises
    MeshError if there is no triangle.

    ``corners (k, 3 corners, 3 coordinates)``, mm.
    """
    tree = build_triangle_tree(corners)

    def distance(points: FloatArray) -> FloatArray:
        points = np.asarray(points, dtype=np.float64)
        return closest_features(tree, points.reshape(3, -1)).distance.reshape(points.shape[1:])

    return distance
