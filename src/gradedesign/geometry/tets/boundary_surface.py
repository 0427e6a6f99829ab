"""The boundary of a tetrahedral mesh as a surface."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import IntArray
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh


def boundary_surface(mesh: TetMesh) -> tuple[SurfaceMesh, IntArray]:
    """Boundary of a tetrahedral mesh, and the mesh point of each of its vertices ``(n,)``."""
    facets, _ = boundary_facets(mesh)
    used, packed = np.unique(facets, return_inverse=True)
    vertices = mesh.points[:, used].T
    return SurfaceMesh(vertices=vertices, faces=packed.reshape(facets.shape)), used
