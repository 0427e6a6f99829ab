"""Faces of two surfaces on one plane, moved apart so that a difference of them is unambiguous."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points

#: Angle up to which two facets may lie on one plane, rad; their corners decide. Chosen, not
#: measured.
_PARALLEL = 1e-4
#: Planes of a vertex whose directions differ less than this are one for its shift: rounding of
#: facets, beside edges of 1 degree and more.
_SAME_DIRECTION = 1e-3


def off_common_planes(cutter: SurfaceMesh, body: SurfaceMesh, *, distance: float) -> SurfaceMesh:
    """Cutter whose faces on planes of a body's faces lie a little outside of the body.

    A cutter that ends flush with a face of the body ends above or below it by rounding, which
    leaves a film there or patches of one. Moved outward, the cutter reaches through, and one that
    only touches the body no longer does.

    Parameters
    ----------
    cutter, body : SurfaceMesh, mm
        Closed, outward oriented.
    distance : float, mm
        A facet of the cutter lies on a plane if its corners are no farther from it; they are moved
        to this distance outside.
    """
    middle = 0.5 * (body.vertices.min(axis=0) + body.vertices.max(axis=0))
    reach = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
    facets, normal, offset = _planes(body, middle, distance)
    own_facets, own_normal, own_offset = _planes(cutter, middle, distance)
    tree = cKDTree(np.column_stack([reach * normal, offset]))
    points = np.column_stack([reach * own_normal, own_offset])
    near = [tree.query_ball_point(sign * points, _PARALLEL * reach) for sign in (1.0, -1.0)]
    low, high = _boxes(body, facets)
    own_low, own_high = _boxes(cutter, own_facets)
    corners = corner_points(cutter)[own_facets] - middle
    wanted: dict[int, list[int]] = {}
    for k, found in enumerate(map(list.__add__, *near)):
        planes = np.array(found, dtype=np.int64)
        off = np.abs(corners[k] @ normal[planes].T - offset[planes]).max(axis=0)
        meet = (own_low[k] <= high[planes] + distance) & (low[planes] <= own_high[k] + distance)
        for vertex in cutter.faces[own_facets[k]].tolist():
            wanted.setdefault(vertex, []).extend(planes[meet.all(axis=1) & (off <= distance)])
    vertices = np.array(cutter.vertices)
    for vertex, shared in wanted.items():
        plane = np.unique(shared).astype(np.int64)
        lack = distance - (normal[plane] @ (vertices[vertex] - middle) - offset[plane])
        shift = np.linalg.lstsq(normal[plane], lack, rcond=_SAME_DIRECTION)[0]
        vertices[vertex] += shift
    return SurfaceMesh(vertices=vertices, faces=cutter.faces)


def _planes(
    surface: SurfaceMesh, middle: FloatArray, distance: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Facets broad enough to have a direction, their normals, and distances from the middle."""
    corners = corner_points(surface) - middle
    area = area_vectors(surface)
    size = np.linalg.norm(area, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    facets = np.flatnonzero(2.0 * size > distance * longest)
    normal = area[facets] / size[facets, None]
    return facets, normal, np.einsum("ij,ij->i", normal, corners[facets].mean(axis=1))


def _boxes(surface: SurfaceMesh, facets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corners of facets' boxes, ``(k, 3)``."""
    corners = corner_points(surface)[facets]
    return corners.min(axis=1), corners.max(axis=1)
