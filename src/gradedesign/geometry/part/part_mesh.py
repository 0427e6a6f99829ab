"""Tetrahedra of the solid part, and the facets of its regions on them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import BoolArray, FloatArray, IntArray, lock, locked
from gradedesign.errors import CaseError, MeshError
from gradedesign.geometry.tets.meshed_surface import MeshedSurface, tetrahedralize
from gradedesign.geometry.tets.mesher import PYTETWILD, Mesher
from gradedesign.geometry.tets.tet_mesh import TetMesh, boundary_facets
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.geometry.triangles.triangle_tree import (
    ClosestPoints,
    build_triangle_tree,
    closest_features,
)

#: Facets of a region are turned against its surface by less, degrees. Chosen, not measured.
_FACET_ANGLE = 40.0
#: A mesh may lie this far from the surface: the smaller of a share of the part's diagonal and a
#: share of the mesh size. Chosen, not measured.
_EPSILON_OF_DIAGONAL, _EPSILON_OF_SIZE = 1e-3, 1 / 20
#: Share of the part's volume by which its mesh may miss it. Chosen, not measured.
VOLUME_TOLERANCE = 0.01
#: Corners of a region closer than this share of its extent are one. Chosen, not measured.
_WELD = 1e-9
#: Facets centred this share of their size beyond a border are left out. Chosen, not measured.
BEYOND = 0.01
#: Standard deviations of a cut region's area that are allowed. Neighbours are cut alike, so that
#: 720 pads on twelve meshes had 1.2 times the deviation of facets that are independent.
_DEVIATIONS = 4.0
#: Largest share of its area by which a region's facets may differ. Chosen, not measured.
_MOST_MISSING = 0.25
#: Least thickness of a box's bricks over the mesh size, at borders. Chosen, not measured.
_THIN = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RegionFacets:
    """Boundary facets of a tetrahedral mesh that represent a region."""

    facets: IntArray  #: ``(k, 3)``. Vertex indices, counter-clockwise seen from outside.
    area: float  #: mm^2.

    def __post_init__(self) -> None:
        lock(self, dtype=np.int64, facets=(None, 3))


def mesh_part(
    surface: SurfaceMesh,
    mesh_size: float,
    *,
    time_limit_s: float,
    memory_limit_bytes: int,
    cache: bool = True,
    mesher: Mesher = PYTETWILD,
) -> MeshedSurface:
    """Mesh the inside of a part's surface.

    Returns MeshedSurface: its volume is within 1 % of the part's. Raises MeshError if the mesher
    fails, runs out of time or its mesh is refused. Raises ResourceError if the mesher needs more
    memory.

    - ``surface``: closed, outward oriented
    - ``mesh_size``, mm: target edge length
    - ``time_limit_s``: for all attempts together, s
    - ``memory_limit_bytes``: of the mesher's process
    - ``cache``: use and fill the user's cache
    """
    _require_size(mesh_size)
    diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    return tetrahedralize(
        surface,
        edge_length=mesh_size,
        epsilon=min(_EPSILON_OF_DIAGONAL * diagonal, _EPSILON_OF_SIZE * mesh_size),
        time_limit_s=time_limit_s,
        memory_limit_bytes=memory_limit_bytes,
        volume_tolerance=VOLUME_TOLERANCE,
        cache=cache,
        mesher=mesher,
    )


def _require_size(mesh_size: float) -> None:
    if not 0.0 < mesh_size < math.inf:
        raise CaseError(f"part.mesh_size is {mesh_size} mm; give a positive length")


def box_planes(
    size: tuple[float, float, float], mesh_size: float, through: Sequence[ArrayLike] = ()
) -> list[FloatArray]:
    """Planes between the bricks of `box_part_mesh` along x, y and z, mm; parameters as there."""
    regions = [np.reshape(points, (-1, 3)) for points in through]
    ends = [end(points, axis=0) for points in regions for end in (np.min, np.max)]
    return [_divided(side, mesh_size, [p[k] for p in ends]) for k, side in enumerate(size)]


def box_part_mesh(
    size: tuple[float, float, float], mesh_size: float, through: Sequence[ArrayLike] = ()
) -> TetMesh:
    """Mesh the box ``[0, a] x [0, b] x [0, c]`` exactly, six tetrahedra to a brick.

    Raises CaseError if a length is not positive.

    ``size``: (3,) floats, mm. ``mesh_size``, mm: no edge of a brick is longer. ``through``:
    sequence of (..., 3) array_likes, mm; points of regions: where they begin and end, bricks do.

    Examples
    --------
    >>> box_part_mesh((2.0, 1.0, 1.0), 1.0).tets.shape
    (4, 12)
    """
    _require_size(mesh_size)
    if len(size) != 3 or not all(0.0 < side < math.inf for side in size):
        raise CaseError(f"part.box has sides {list(size)} mm; give three positive lengths")
    axes = box_planes(size, mesh_size, through)
    counts = [len(axis) - 1 for axis in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    index = np.arange(points.shape[1]).reshape([n + 1 for n in counts])
    steps = [(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1]
    base = index[:-1, :-1, :-1].ravel()
    tets = []
    for order in itertools.permutations(range(3)):
        path = [base]
        for axis in order:
            path.append(path[-1] + steps[axis])
        if np.linalg.det(np.eye(3)[list(order)]) < 0:
            path[2], path[3] = path[3], path[2]
        tets.append(np.stack(path))
    # Brick by brick, so that neighbours in space are neighbours in memory.
    return TetMesh(points=points, tets=np.stack(tets, axis=-1).reshape(4, -1))


def _divided(side: float, mesh_size: float, through: Sequence[float]) -> FloatArray:
    """Planes of bricks along a side; planes that would make thin bricks are left out."""
    planes, thin = [0.0], _THIN * min(mesh_size, side)
    for plane in [*sorted(through), side]:
        if plane - planes[-1] > thin and (side - plane > thin or plane == side):
            n = max(1, math.ceil((plane - planes[-1]) / mesh_size - 1e-9))
            planes.extend(np.linspace(planes[-1], plane, n + 1)[1:])
    return np.array(planes)


def _border(corners: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Edges 01, 12, 20 and corners of triangles that lie on the border of their patch, (k, 3)."""
    scale = max(float(np.ptp(corners.reshape(-1, 3), axis=0).max()), 1e-300)
    keys = np.rint((corners.reshape(-1, 3) - corners.reshape(-1, 3).min(axis=0)) / (_WELD * scale))
    vertex = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1, 3)
    ahead = np.roll(vertex, -1, axis=1)
    n = vertex.max() + 1
    edge = np.minimum(vertex, ahead) * n + np.maximum(vertex, ahead)
    _, inverse, count = np.unique(edge.ravel(), return_inverse=True, return_counts=True)
    edges = (count[inverse] == 1).reshape(-1, 3)
    rim = np.unique(np.concatenate([vertex[edges], ahead[edges]]))
    return edges, np.isin(vertex, rim)


def _beyond_border(
    corners: FloatArray, normals: FloatArray, centres: FloatArray, nearest: ClosestPoints
) -> FloatArray:
    """Distance of centres ``(3, n)`` beyond the border of the patch, along it, mm; 0 within."""
    edges, rims = _border(corners)
    on_border = np.concatenate([np.zeros((len(corners), 1), dtype=bool), edges, rims], axis=1)
    gap = centres - nearest.point
    normal = normals[nearest.triangle].T
    along = gap - normal * (gap * normal).sum(axis=0)
    outside = on_border[nearest.triangle, nearest.feature]
    return np.where(outside, np.linalg.norm(along, axis=0), 0.0)


def region_facets(mesh: TetMesh, corners: ArrayLike, *, tolerance: float) -> RegionFacets:
    """Find the boundary facets of a mesh that represent a region of the surface it was made from.

    A facet counts if its centre lies within ``tolerance`` of the region's triangles, does not
    fall beyond the region's border, and its normal is within an angle of the nearest triangle's.

    Returns RegionFacets: may be empty: check with :func:`check_region_area`. Raises MeshError if
    the region has no triangle.

    ``corners (k, 3 corners, 3 coordinates)``, mm: triangles of the region, counter-clockwise seen
    from outside. ``tolerance``, mm: more than the mesh's distance from the surface, less than the
    part's thickness.
    """
    triangles = locked(corners, (None, 3, 3), name="corners")
    tree = build_triangle_tree(triangles)
    facets, _ = boundary_facets(mesh)
    a, b, c = (mesh.points[:, facets[:, k]] for k in range(3))
    vectors = 0.5 * np.cross(b - a, c - a, axis=0)
    areas = np.linalg.norm(vectors, axis=0)
    centres = (a + b + c) / 3.0
    nearest = closest_features(tree, centres)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    cosine = (vectors * normals[nearest.triangle].T).sum(axis=0)
    chosen = (
        (nearest.distance <= tolerance)
        & (cosine >= math.cos(math.radians(_FACET_ANGLE)) * areas)
        & (_beyond_border(triangles, normals, centres, nearest) <= BEYOND * np.sqrt(areas))
    )
    return RegionFacets(facets=facets[chosen], area=float(areas[chosen].sum()))


def check_region_area(
    region: RegionFacets,
    expected: float,
    *,
    name: str = "region",
    rel: float = 0.05,
    cut_length: float = 0.0,
) -> None:
    """Refuse facets whose area differs from the region's.

    Facets end at the edges of the part, but run across the border that a clipping box cuts, where
    each counts as a whole or not at all. Its error is then spread evenly over half its area to
    either side, with a standard deviation of 1/sqrt(12) of it. A cut of length L crosses 2/pi of
    the length of edges per area, times L (Crofton), which for equilateral facets of edge e are 4
    sqrt(3)/pi L/e facets. Four deviations of their sum are allowed. Raises `MeshError`.

    - ``expected``, mm^2
    - ``name``: used in the message
    - ``rel``: largest relative difference
    - ``cut_length``, mm: length of the region's border that no edge of the part follows
    """
    facet = region.area / max(len(region.facets), 1)
    edge = math.sqrt(4.0 / math.sqrt(3.0) * facet)  # of an equilateral triangle
    crossed = 4.0 * math.sqrt(3.0) / math.pi * cut_length / edge if edge else 0.0
    deviation = math.sqrt(crossed / 12.0) * facet
    allowed = min(rel * expected + _DEVIATIONS * deviation, _MOST_MISSING * expected)
    if not abs(region.area - expected) <= allowed:
        raise MeshError(
            f"region '{name}': its {len(region.facets)} facets on the mesh have {region.area:.6g} "
            f"mm^2, the region has {expected:.6g} mm^2, allowed is a difference of "
            f"{100 * allowed / expected:.3g} %; use a smaller part.mesh_size"
        )
