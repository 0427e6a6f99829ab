"""A closed surface whose facets are moved along their normals, each by its own length."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, area_vectors, corner_points

#: Directions in which the normals about a vertex differ by less are taken as one: its shift along
#: them would be their small differences magnified. A crease is kept from 26 degrees of turn on
#: (``sin^2`` of half of it); at a rim of two faces that enclose less than 26 degrees the vertex
#: stays within 4.5 offsets. Chosen, not measured.
_LEAST_SPREAD = 0.05


def facet_normals(surface: SurfaceMesh) -> FloatArray:
    """Outward unit normals, ``(m, 3)``; zero for facets without area."""
    vectors = area_vectors(surface)
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny))


def shifts_of(surface: SurfaceMesh, offsets: FloatArray) -> FloatArray:
    """Shift of every vertex that moves the facets around it by their offsets, ``(n, 3)``, mm.

    The least squares solution of ``n . shift = offset`` over the facets, weighted by their angles
    at the vertex: on smooth surfaces along the mean normal, at an edge or a corner to where the
    moved planes meet. Exact for planes, of second order in the offset over the radius elsewhere.

    ``offsets``, (m, 3) array, mm: of every facet at each of its corners; outwards is positive.
    """
    normals, corners = facet_normals(surface), corner_points(surface)
    matrix, right = np.zeros((len(surface.vertices), 6)), np.zeros((len(surface.vertices), 3))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for k in range(3):
        vertex = surface.faces[:, k]
        weight = _angles(corners, k)
        for column, (a, b) in enumerate(pairs):
            matrix[:, column] += np.bincount(
                vertex, weight * normals[:, a] * normals[:, b], len(matrix)
            )
        for axis in range(3):
            right[:, axis] += np.bincount(
                vertex, weight * normals[:, axis] * offsets[:, k], len(matrix)
            )
    full = matrix[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    values, axes = np.linalg.eigh(full)
    kept = values > np.maximum(_LEAST_SPREAD * values[:, -1:], np.finfo(float).tiny)
    along = np.einsum("nij,ni->nj", axes, right)
    along = np.where(kept, along / np.where(kept, values, 1.0), 0.0)
    return np.asarray(np.einsum("nij,nj->ni", axes, along))


def _angles(corners: FloatArray, k: int) -> FloatArray:
    """Angle of every triangle at one of its corners, ``(m,)``."""
    one = corners[:, (k + 1) % 3] - corners[:, k]
    other = corners[:, (k + 2) % 3] - corners[:, k]
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.asarray(np.arctan2(across, np.einsum("mi,mi->m", one, other)))
