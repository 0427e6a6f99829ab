"""Members that tie in what is solid in any case: without cells nothing else does.

A limit ties what it depends on. A bolt's sleeve that carries next to nothing may be left alone,
which is no body that can be printed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.sizing.filter import DensityFilter, filtered
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.members import MemberField, mean_share

#: Share of a tetrahedron from which on it is solid.
_HALF = 0.5
#: Radius of a tie in variables over the least thickness: by the filter's cone over 1.25 of it, what
#: exceeds a half is then about as thick as stated. Chosen, not measured.
_RADIUS = 0.7
#: Length of a way through solid, over its own, for the shortest tie. Chosen, not measured.
_IN_SOLID = 0.1


def tied(
    part: HomogenisedModel, members: DensityFilter, field: MemberField, least: float
) -> MemberField:
    """The field of members with a tie along the shortest way to every solid that stands alone.

    ``part``: without the members. ``members``: of `member_filter`. ``field``: variables of the
    tetrahedra. ``least``, mm: thickness of a tie, about.
    """
    mesh = part.space.mesh
    share = mean_share((filtered(members, field.variables) > _HALF).astype(np.float64))
    solid = part.solid_fraction + (1.0 - part.solid_fraction) * share > _HALF
    passive = part.volumes * part.solid_fraction * solid
    beside = _neighbours(mesh)
    _, label = connected_components(beside[solid][:, solid], directed=False)
    at = np.flatnonzero(solid)
    kept = np.bincount(label, weights=passive[at])
    alone = [n for n in np.argsort(-kept, kind="stable")[1:] if kept[n] > 0]
    if not alone:
        return field
    points, variables = centroids(mesh), np.array(field.variables)
    joined = at[label == np.argmax(kept)]
    graph = _lengths(beside, points, solid)
    for n in alone:
        piece = at[label == n]
        way = _way(graph, joined, piece)
        near = cKDTree(points[:, way].T).query(points.T)[0] <= _RADIUS * least
        variables[near] = 1.0
        joined = np.concatenate([joined, piece, np.flatnonzero(near)])
    return replace(field, variables=variables, tied=True)


def _neighbours(mesh: TetMesh) -> csr_matrix:
    """Which tetrahedra have a facet in common, ``(M, M)``."""
    count = mesh.tets.shape[1]
    corners = np.concatenate([np.delete(mesh.tets, k, axis=0) for k in range(4)], axis=1)
    _, facet = np.unique(np.sort(corners, axis=0), axis=1, return_inverse=True)
    order = np.argsort(facet.ravel(), kind="stable")
    same = np.flatnonzero(np.diff(facet.ravel()[order]) == 0)
    a, b = order[same] % count, order[same + 1] % count
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    return csr_matrix((np.ones(rows.size), (rows, columns)), shape=(count, count))


def _lengths(beside: csr_matrix, points: FloatArray, solid: BoolArray) -> csr_matrix:
    """Distances of neighbours, mm; shorter in solid, which costs nothing."""
    pairs = beside.tocoo()
    length = np.linalg.norm(points[:, pairs.row] - points[:, pairs.col], axis=0)
    length[solid[pairs.row] & solid[pairs.col]] *= _IN_SOLID
    return csr_matrix((length, (pairs.row, pairs.col)), shape=beside.shape)


def _way(graph: csr_matrix, start: IntArray, ends: IntArray) -> IntArray:
    """Tetrahedra of the shortest way from any of ``start`` to any of ``ends``."""
    length, before, _ = dijkstra(
        graph, indices=start, min_only=True, return_predecessors=True, directed=False
    )
    way = [int(ends[np.argmin(length[ends])])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return np.array(way)
