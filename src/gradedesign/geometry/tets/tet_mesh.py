"""A stored tetrahedral mesh, in scikit-fem's component-first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray, IntArray, lock
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class TetMesh(ShownRecord):
    """Straight-sided tetrahedra of positive volume.

    Attributes
    ----------
    points : (3, n) array, mm
    tets : (4, m) int array
        Vertex indices; ``det(p1 - p0, p2 - p0, p3 - p0) > 0`` for every tetrahedron.
    """

    points: FloatArray
    tets: IntArray

    def __post_init__(self) -> None:
        lock(self, points=(3, None))
        lock(self, dtype=np.int64, tets=(4, None))
        if self.tets.size and (self.tets.min() < 0 or self.tets.max() >= self.points.shape[1]):
            raise ValueError(
                f"tets refer to points {self.tets.min()} to {self.tets.max()}, "
                f"but there are {self.points.shape[1]}"
            )


def signed_volumes(mesh: TetMesh) -> FloatArray:
    """Signed volume of every tetrahedron, ``(m,)``, mm^3.

    Examples
    --------
    >>> corners = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 6]])
    >>> signed_volumes(TetMesh(points=corners, tets=np.array([[0], [1], [2], [3]])))
    array([1.])
    """
    a, b, c, d = (mesh.points[:, mesh.tets[k]] for k in range(4))
    return np.einsum("ij,ij->j", b - a, np.cross(c - a, d - a, axis=0)) / 6.0


def centroids(mesh: TetMesh) -> FloatArray:
    """Centroid of every tetrahedron, ``(3, m)``, mm."""
    return mesh.points[:, mesh.tets].mean(axis=1)


def boundary_facets(mesh: TetMesh) -> tuple[IntArray, IntArray]:
    """Facets that belong to one tetrahedron only.

    Returns ``facets (k, 3)``: vertex indices, counter-clockwise seen from outside; ``owners (k,)``:
    the tetrahedron behind each facet.
    """
    t = mesh.tets
    faces = np.concatenate([t[[1, 2, 3]].T, t[[0, 3, 2]].T, t[[0, 1, 3]].T, t[[0, 2, 1]].T], axis=0)
    owners = np.tile(np.arange(t.shape[1], dtype=np.int64), 4)
    ordered = np.sort(faces, axis=1)
    n = np.int64(mesh.points.shape[1])
    order = np.lexsort((ordered[:, 2], ordered[:, 0] * n + ordered[:, 1]))
    same = np.all(ordered[order][1:] == ordered[order][:-1], axis=1)
    single = np.ones(len(order), dtype=bool)
    single[1:] &= ~same
    single[:-1] &= ~same
    chosen = np.sort(order[single])
    return faces[chosen], owners[chosen]


def boundary_surface(mesh: TetMesh) -> tuple[SurfaceMesh, IntArray]:
    """Boundary of a tetrahedral mesh, and the mesh point of each of its vertices ``(n,)``."""
    facets, _ = boundary_facets(mesh)
    used, packed = np.unique(facets, return_inverse=True)
    vertices = mesh.points[:, used].T
    return SurfaceMesh(vertices=vertices, faces=packed.reshape(facets.shape)), used
