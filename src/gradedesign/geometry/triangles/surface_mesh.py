"""A stored triangle surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.geometry.triangles._surface_mesh_kernels import signed_volume


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class SurfaceMesh(ShownRecord):
    """Triangles over shared vertices, outward oriented where closed.

    Attributes
    ----------
    vertices : (n, 3) array, mm
    faces : (m, 3) int array
        Vertex indices, counter-clockwise seen from outside.
    """

    vertices: FloatArray
    faces: IntArray

    def __post_init__(self) -> None:
        lock(self, vertices=(None, 3))
        lock(self, dtype=np.int64, faces=(None, 3))
        if self.faces.size and (self.faces.min() < 0 or self.faces.max() >= len(self.vertices)):
            raise ValueError(
                f"faces refer to vertices {self.faces.min()} to {self.faces.max()}, "
                f"but there are {len(self.vertices)}"
            )


def corner_points(surface: SurfaceMesh) -> FloatArray:
    """Corners of every triangle, ``(m, 3 corners, 3 coordinates)``, mm."""
    return surface.vertices[surface.faces]


def area_vectors(surface: SurfaceMesh) -> FloatArray:
    """Outward normals times area, ``(m, 3)``, mm^2."""
    a, b, c = np.moveaxis(corner_points(surface), 1, 0)
    return 0.5 * np.cross(b - a, c - a)


def integral_mean_curvature(surface: SurfaceMesh) -> float:
    """Integral of mean curvature over a closed surface, mm; positive where it is convex.

    Half the sum of length times turn over its edges: of a convex body the integral of mean
    curvature of what it grows to (Santalo, Integral Geometry, 1976, chapter III.13).
    """
    start, count = surface.faces.ravel(), len(surface.vertices)
    end = np.roll(surface.faces, -1, axis=1).ravel()
    ahead, back = start * count + end, end * count + start
    order = np.argsort(ahead)
    once = start < end
    twin = order[np.searchsorted(ahead, back[once], sorter=order) % len(order)]
    normals = area_vectors(surface)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    mine, other = normals[np.flatnonzero(once) // 3], normals[twin // 3]
    along = surface.vertices[end[once]] - surface.vertices[start[once]]
    # The cross product of the normals points along the edge: its length times the turn's sine.
    across = np.einsum("ij,ij->i", np.cross(mine, other), along)
    length = np.linalg.norm(along, axis=1)
    turn = np.arctan2(across, length * np.einsum("ij,ij->i", mine, other))
    return float(0.5 * length @ turn)


def enclosed_volume(surface: SurfaceMesh) -> float:
    """Signed enclosed volume by the divergence theorem, mm^3; positive if normals point out."""
    if len(surface.faces) == 0:
        return 0.0
    return float(signed_volume(surface.vertices, surface.faces))


def enclosed_centroid(surface: SurfaceMesh) -> FloatArray:
    """Centroid of the enclosed volume by the divergence theorem, ``(3,)``, mm."""
    middle = surface.vertices.mean(axis=0)
    a, b, c = np.moveaxis(corner_points(surface) - middle, 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    return np.asarray(middle + volumes @ (a + b + c) / (4.0 * volumes.sum()))


def open_edge_count(surface: SurfaceMesh) -> int:
    """Count directed edges without their opposite: 0 for a closed, consistently oriented mesh."""
    f = surface.faces
    edges = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    n = len(surface.vertices)
    forward = edges[:, 0] * n + edges[:, 1]
    backward = edges[:, 1] * n + edges[:, 0]
    keys, counts = np.unique(np.concatenate([forward, backward]), return_counts=True)
    directed, directed_counts = np.unique(forward, return_counts=True)
    matched = counts[np.searchsorted(keys, directed)]
    return int(np.count_nonzero((matched != 2) | (directed_counts != 1)))


def unbalanced_edge_count(surface: SurfaceMesh) -> int:
    """Count edges that are not passed equally often in both directions.

    0 means that the enclosed volume is well defined. Weaker than
    `open_edge_count`: an edge of four triangles, where two shells touch, is balanced.
    """
    faces = surface.faces
    start = faces.ravel()
    end = np.roll(faces, -1, axis=1).ravel()
    name = np.minimum(start, end) * np.int64(len(surface.vertices)) + np.maximum(start, end)
    _, edge = np.unique(name, return_inverse=True)
    balance = np.bincount(edge, weights=np.sign(end - start))
    return int(np.count_nonzero(balance))
