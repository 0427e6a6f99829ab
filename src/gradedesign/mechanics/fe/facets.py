"""Facets of a finite element space: their nodes and their outward direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import SolverError
from gradedesign.mechanics.fe.space import TetSpace

#: Local vertices of the facet opposite each local vertex, counter-clockwise seen from outside.
_LOCAL_FACETS = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]], dtype=np.int64)

#: Local P2 nodes of those facets: the corners a, b, c, then the middles of ab, bc and ca.
_LOCAL_FACET_NODES = np.array(
    [[1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6], [0, 1, 3, 4, 8, 7], [0, 2, 1, 6, 5, 4]],
    dtype=np.int64,
)


def _checked_facets(space: TetSpace, facets: ArrayLike) -> IntArray:
    """Facets as ``(k, 3)`` vertex indices of the mesh."""
    indices = np.asarray(facets, dtype=np.int64)
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise ValueError(f"facets have shape {indices.shape}, expected (k, 3) vertex indices")
    if len(indices) == 0:
        raise SolverError(
            "no facet was given, so the load or support would act nowhere; "
            "check the region it names and the mesh size"
        )
    vertices = space.mesh.points.shape[1]
    if indices.min() < 0 or indices.max() >= vertices:
        raise ValueError(
            f"facets refer to vertices {indices.min()} to {indices.max()}, the mesh has {vertices}"
        )
    return indices


def _keys(triples: IntArray, base: int) -> IntArray:
    """One integer per vertex triple ``(k, 3)``, independent of the order of its corners."""
    a, b, c = np.sort(triples, axis=1).T
    return (a * base + b) * base + c


def facet_owners(space: TetSpace, facets: ArrayLike) -> tuple[IntArray, IntArray, IntArray]:
    """Find the tetrahedron behind each facet.

    Raises `SolverError` if there is no facet, or one is no face of any tetrahedron.

    ``facets (k, 3)``: vertex indices, in any order. Returns ``owners (k,)``: one tetrahedron that
    has the facet; the first one for a facet inside the mesh; ``sides (k,)``: the local vertex
    opposite the facet, 0 to 3; ``sharing (k,)``: how many tetrahedra have the facet: 1 on the
    boundary, 2 inside.
    """
    sought = _checked_facets(space, facets)
    used, compact = np.unique(sought, return_inverse=True)
    base = len(used)
    if base > 2_000_000:
        raise SolverError(
            f"{base} vertices in one set of facets, at most 2000000 can be told apart; "
            "split the set"
        )
    local = np.full(space.mesh.points.shape[1], -1, dtype=np.int64)
    local[used] = np.arange(base)
    corners = local[space.mesh.tets]
    touching = np.flatnonzero(np.count_nonzero(corners >= 0, axis=0) >= 3)
    corners = corners[:, touching]
    keys, owners, sides = [], [], []
    for opposite, three in enumerate(_LOCAL_FACETS):
        hit = np.flatnonzero((corners[three] >= 0).all(axis=0))
        keys.append(_keys(corners[np.ix_(three, hit)].T, base))
        owners.append(touching[hit])
        sides.append(np.full(len(hit), opposite, dtype=np.int64))
    key, owner, side = np.concatenate(keys), np.concatenate(owners), np.concatenate(sides)
    order = np.argsort(key, kind="stable")
    key, owner, side = key[order], owner[order], side[order]
    wanted = _keys(compact.reshape(sought.shape), base)
    first = np.searchsorted(key, wanted, side="left")
    sharing = np.searchsorted(key, wanted, side="right") - first
    if (sharing == 0).any():
        bad = sought[int(np.argmax(sharing == 0))]
        raise SolverError(
            f"{np.count_nonzero(sharing == 0)} of {len(sought)} facets are no face of any "
            f"tetrahedron, the first has vertices {bad.tolist()}; take facets of this very mesh"
        )
    return owner[first], side[first], sharing


def facet_nodes(space: TetSpace, facets: ArrayLike) -> IntArray:
    """Nodes of each facet, counter-clockwise seen from outside its tetrahedron.

    Raises `SolverError` if there is no facet, or one is no face of any tetrahedron. Returns (6, k)
    int array for quadratic elements, (3, k) for linear ones: the corners a, b, c, then the middles
    of the edges ab, bc and ca.

    ``facets (k, 3)``: vertex indices, in any order.
    """
    owners, sides, _ = facet_owners(space, facets)
    local = _LOCAL_FACET_NODES if space.order == 2 else _LOCAL_FACETS
    return space.elements[local[sides].T, owners].astype(np.int64)


def outward_area_vectors(space: TetSpace, facets: ArrayLike) -> FloatArray:
    """Area times outward normal of boundary facets, ``(3, k)``, mm^2.

    The direction comes from the tetrahedron behind the facet, not from the order of its corners.
    Raises `SolverError` if a facet lies inside the mesh, where no side is outside.
    """
    owners, sides, sharing = facet_owners(space, facets)
    if (sharing > 1).any():
        raise SolverError(
            f"{np.count_nonzero(sharing > 1)} of {len(sharing)} facets lie inside the mesh, "
            "where a pressure has no direction; give boundary facets only"
        )
    corners = space.mesh.tets[_LOCAL_FACETS[sides].T, owners]
    a, b, c = (space.mesh.points[:, corner] for corner in corners)
    return 0.5 * np.cross(b - a, c - a, axis=0)


def facet_areas(space: TetSpace, facets: ArrayLike) -> FloatArray:
    """Area of each facet, ``(k,)``, mm^2."""
    corners = _checked_facets(space, facets).T
    a, b, c = (space.mesh.points[:, corner] for corner in corners)
    return np.linalg.norm(0.5 * np.cross(b - a, c - a, axis=0), axis=0)
