"""Move vertices of a tetrahedral mesh onto sharp edges wherever the tetrahedra stay good."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mesh.tet_mesh import TetMesh

log = logging.getLogger(__name__)

#: A vertex lies on a face when the face's field is smaller than this, in grid spacings.
ON_FACE = 0.08
#: A vertex moves at most this far, in grid spacings. The tip of a wedge of less than 70 degrees
#: lies farther than one spacing from the surface that the grid resolves.
FARTHEST = 1.5
#: Dihedral angles that moved tetrahedra must keep, degrees.
LEAST_ANGLE, LARGEST_ANGLE = 9.0, 165.0
#: Rounds of moves: all nearer ends at once, then one by one those that spoiled a tetrahedron.
ROUNDS = 16

#: Places on the edge for vertices given by number: ``(3, k)`` mm and whether each is one, ``(k,)``.
Targets = Callable[[IntArray], tuple[FloatArray, BoolArray]]


def move_onto_edge(
    mesh: TetMesh, crossing: IntArray, near: FloatArray, targets: Targets, spacing: float
) -> TetMesh:
    """Move one end of every chamfered side onto the edge, where the tetrahedra stay good.

    First the nearer ends all at once, then one by one those whose move spoiled a tetrahedron, then
    the other ends.

    Parameters
    ----------
    mesh : TetMesh
    crossing : (k, 2) int array
        Sides of boundary triangles from one face to the other.
    near : (n,) array, mm
        Of every vertex, about its distance from the edge; infinite where it must stay.
    targets : callable
        Of vertices, their places on the edge.
    spacing : float, mm
        Grid spacing of the mesh.

    Returns
    -------
    TetMesh
        Same connectivity.
    """
    if len(crossing) == 0:
        return mesh
    points, near = np.array(mesh.points), np.array(near)
    snapped = np.zeros(points.shape[1], dtype=bool)
    for turn in range(ROUNDS):
        remaining = crossing[
            ~snapped[crossing].any(axis=1) & np.isfinite(near[crossing]).any(axis=1)
        ]
        movers = np.unique(remaining[np.arange(len(remaining)), np.argmin(near[remaining], axis=1)])
        if len(movers) == 0:
            break
        if turn > 0:
            movers = _apart(movers, mesh.tets, points.shape[1])
        _move(points, mesh.tets, movers, targets(movers), spacing, snapped)
        if turn > 0:
            near[movers[~snapped[movers]]] = np.inf
    log.info(
        "snapped %d vertices, %d of %d chamfered sides left",
        np.count_nonzero(snapped), np.count_nonzero(~snapped[crossing].any(axis=1)), len(crossing),
    )  # fmt: skip
    return TetMesh(points=points, tets=mesh.tets)


def sides_between(facets: IntArray, side: IntArray) -> IntArray:
    """Triangle sides between a vertex on face 1 and one on face 2, ``(k, 2)``.

    ``facets`` ``(m, 3)`` are the boundary triangles, ``side`` ``(n,)`` the face of every vertex, 0
    for none.
    """
    ends = sides_of(facets)
    return ends[side[ends].min(axis=1) * side[ends].max(axis=1) == 2]


def sides_of(facets: IntArray) -> IntArray:
    """Every side of closed, oriented triangles ``(m, 3)`` once, ``(k, 2)``, lower number first."""
    ends = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
    return ends[ends[:, 0] < ends[:, 1]]


def _move(
    points: FloatArray,
    tets: IntArray,
    movers: IntArray,
    places: tuple[FloatArray, BoolArray],
    spacing: float,
    snapped: BoolArray,
) -> None:
    """Move vertices onto the edge in place, but for those that reach too far or spoil a tet."""
    before = points[:, movers].copy()
    target, sound = places
    keep = sound & (np.linalg.norm(target - before, axis=0) <= FARTHEST * spacing)
    points[:, movers[keep]] = target[:, keep]
    moved = np.zeros(points.shape[1], dtype=bool)
    moved[movers[keep]] = True
    touched = np.flatnonzero(moved[tets].any(axis=0))
    while True:
        bad = touched[_is_bad(points, tets[:, touched])]
        culprits = np.unique(tets[:, bad])
        culprits = culprits[moved[culprits]]
        if len(culprits) == 0:
            break
        points[:, culprits] = before[:, np.searchsorted(movers, culprits)]
        moved[culprits] = False
    snapped |= moved


def _apart(movers: IntArray, tets: IntArray, count: int) -> IntArray:
    """Subset of ascending vertices that share no tetrahedron with a kept one of lower number."""
    rank = np.full(count, count)
    rank[movers] = movers
    near = tets[:, (rank[tets] < count).any(axis=0)]
    least = np.full(count, count)
    for corner in near:
        np.minimum.at(least, corner, rank[near].min(axis=0))
    return movers[least[movers] == movers]


def _is_bad(points: FloatArray, tets: IntArray) -> BoolArray:
    """Tetrahedra with an angle out of bounds or without positive volume."""
    p = points[:, tets]
    volume = np.einsum("im,im->m", p[:, 1] - p[:, 0], _cross(p, 0, 2, 3))
    normals = [_cross(p, 1, 2, 3), _cross(p, 0, 3, 2), _cross(p, 0, 1, 3), _cross(p, 0, 2, 1)]
    lengths = [np.maximum(np.linalg.norm(n, axis=0), 1e-150) for n in normals]
    bad = volume <= 0
    for i in range(3):
        for j in range(i + 1, 4):
            cosine = -np.einsum("im,im->m", normals[i], normals[j]) / (lengths[i] * lengths[j])
            bad |= cosine > np.cos(np.radians(LEAST_ANGLE))
            bad |= cosine < np.cos(np.radians(LARGEST_ANGLE))
    return np.asarray(bad)


def _cross(p: FloatArray, a: int, b: int, c: int) -> FloatArray:
    """Twice the area vectors of triangles abc, ``(3, m)``; outward for the orders used here."""
    return np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a], axis=0)
