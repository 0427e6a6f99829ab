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
from gradedesign.errors import LatticeError
from gradedesign.geometry.tets.tet_mesh import TetMesh, centroids
from gradedesign.mechanics.sizing.filter import filtered
from gradedesign.mechanics.sizing.homogenised_model import HomogenisedModel
from gradedesign.mechanics.sizing.members import MemberField, Members, mean_share
from gradedesign.mechanics.solver.rigid_modes import triple_words

#: Share of a tetrahedron from which on it is solid.
_HALF = 0.5
#: Radius of a tie in variables over the least thickness: by the filter's cone over 1.25 of it, what
#: exceeds a half is then about as thick as stated. Chosen, not measured.
_RADIUS = 0.7
#: Length of a way through solid, over its own, for the shortest tie. Chosen, not measured.
_IN_SOLID = 0.1


def tied(part: HomogenisedModel, members: Members, field: MemberField, least: float) -> MemberField:
    """The field of members with a tie along the shortest way to every solid that stands alone.

    Raises `LatticeError` where every way goes through zones that keep members out.

    ``part``: without the members. ``field``: variables of the tetrahedra. ``least``, mm: thickness
    of a tie, about.
    """
    mesh = part.space.mesh
    share = mean_share((filtered(members.filter, field.variables) > _HALF).astype(np.float64))
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
    open_to = np.ones(solid.size, dtype=np.bool_)
    if members.allowed is not None:
        open_to = solid | (mean_share(members.allowed) > _HALF)
    graph = _lengths(beside, points, solid, open_to)
    for n in alone:
        piece = at[label == n]
        way = _way(graph, joined, piece)
        if way.size == 0:
            middle = points[:, piece] @ (passive[piece] / passive[piece].sum())
            raise LatticeError(
                f"the kept solid about {triple_words(middle)} mm is joined to nothing, and every "
                f"way to other solid goes through zones that keep members out; let them into one "
                f"of these, [[zone]] phases, or keep less there"
            )
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


def _lengths(
    beside: csr_matrix, points: FloatArray, solid: BoolArray, open_to: BoolArray
) -> csr_matrix:
    """Distances of neighbours, mm, that are open to ties; shorter in solid, which costs nothing."""
    pairs = beside.tocoo()
    kept = open_to[pairs.row] & open_to[pairs.col]
    row, column = pairs.row[kept], pairs.col[kept]
    length = np.linalg.norm(points[:, row] - points[:, column], axis=0)
    length[solid[row] & solid[column]] *= _IN_SOLID
    return csr_matrix((length, (row, column)), shape=beside.shape)


def _way(graph: csr_matrix, start: IntArray, ends: IntArray) -> IntArray:
    """Tetrahedra of the shortest way from any of ``start`` to any of ``ends``; none if none is."""
    length, before, _ = dijkstra(
        graph, indices=start, min_only=True, return_predecessors=True, directed=False
    )
    if not np.isfinite(length[ends]).any():
        return np.zeros(0, dtype=np.int64)
    way = [int(ends[np.argmin(length[ends])])]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return np.array(way)
