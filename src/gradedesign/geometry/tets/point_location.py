"""Search for the tetrahedron that holds a point, with the point's coordinates in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.common.system.threads import in_ranges
from gradedesign.errors import MeshError
from gradedesign.geometry.tets import _point_location_kernels as kernels
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.geometry.triangles.triangle_tree import (
    TriangleTree,
    build_triangle_tree,
    closest_triangles,
)

#: Tetrahedra per bin of the grid, on average, were they spread evenly. Chosen, not measured.
_PER_BIN = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TetLocator:
    """Tetrahedra sorted into the bins of a uniform grid."""

    points: FloatArray  #: ``(n, 3)``, mm.
    tets: IntArray  #: ``(m, 4)``.
    lower: FloatArray  #: ``(3,)``, mm. Lower corner of the grid.
    size: float  #: mm. Edge of a bin.
    shape: IntArray  #: ``(3,)``. Bins per axis.
    first: IntArray  #: Tetrahedra of bin b are ``members[first[b]:first[b + 1]]``.
    members: NDArray[np.int32]  #: As `first`.
    #: TriangleTree, (k,) int array. The boundary facets and the tetrahedra behind them.
    tree: TriangleTree
    owners: IntArray  #: As `tree`.


def build_locator(mesh: TetMesh) -> TetLocator:
    """Sort the tetrahedra of a mesh for :func:`locate`.

    Raises MeshError if the mesh is empty.
    """
    m = mesh.tets.shape[1]
    if m == 0:
        raise MeshError("point location: the mesh has no tetrahedra")
    points = np.ascontiguousarray(mesh.points.T)
    tets = np.ascontiguousarray(mesh.tets.T)
    used = mesh.points[:, np.unique(mesh.tets)]
    lower = used.min(axis=1)
    extent = used.max(axis=1) - lower
    size = float((extent.prod() * _PER_BIN / m) ** (1 / 3))
    shape = np.maximum(np.ceil(extent / size), 1).astype(np.int64)
    first = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
    members = np.zeros(0, dtype=np.int32)
    kernels.bin_tets(False, points, tets, lower, size, shape, first[1:], members)
    np.cumsum(first, out=first)
    members = np.zeros(int(first[-1]), dtype=np.int32)
    kernels.bin_tets(True, points, tets, lower, size, shape, first[:-1].copy(), members)
    facets, owners = boundary_facets(mesh)
    return TetLocator(
        points=points,
        tets=tets,
        lower=lower,
        size=size,
        shape=shape,
        first=first,
        members=members,
        tree=build_triangle_tree(points[facets]),
        owners=owners,
    )


def locate(
    mesh: TetMesh, points: FloatArray, *, locator: TetLocator | None = None
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Find the tetrahedron of every point, or the nearest one.

    Raises MeshError if the mesh is empty. Raises ValueError if a point is not finite or the shape
    is wrong.

    ``points (3, n)``, mm. ``locator``: of the same mesh, from :func:`build_locator`, where it is
    asked more than once. Returns ``tets (n,)``: the lowest number where a point lies on a shared
    facet; ``barycentric (4, n)``: coordinates that sum to 1; of a point outside, those of the
    nearest point of the mesh; ``distance (n,)``, mm: 0 inside, distance to the mesh outside: refuse
    what is farther than makes sense.
    """
    queries = np.array(points, dtype=np.float64, order="C")
    if queries.ndim != 2 or len(queries) != 3:
        raise ValueError(f"points have shape {queries.shape}, expected (3, n)")
    if not np.isfinite(queries).all():
        raise ValueError(f"{np.count_nonzero(~np.isfinite(queries))} coordinates are not finite")
    at = build_locator(mesh) if locator is None else locator
    n = queries.shape[1]
    owner = np.zeros(n, dtype=np.int64)
    numbers = range(0, owner.size, kernels.POINTS)
    in_ranges(
        kernels.find_tets,
        numbers,
        at.points,
        at.tets,
        at.lower,
        at.size,
        at.shape,
        at.first,
        at.members,
        queries,
        owner,
    )
    distance = np.zeros(n)
    outside = np.flatnonzero(owner < 0)
    if len(outside):
        far, facet, nearest = closest_triangles(at.tree, queries[:, outside])
        owner[outside] = at.owners[facet]
        distance[outside] = far
        queries[:, outside] = nearest
    weights = np.zeros((4, n))
    in_ranges(kernels.weigh, numbers, at.points, at.tets, owner, queries, weights)
    return owner, weights, distance
