"""Snap vertices of a stuffed mesh to the feature edge where two smooth surfaces meet.

Isosurface stuffing cuts off an edge between two faces: the surface triangle runs from a vertex on
one face to a vertex on the other. Here one end of each such triangle side is moved onto the edge,
the intersection of both zero sets, wherever the tetrahedra around it stay good: first the nearer
ends all at once, then one by one those whose move spoiled a tetrahedron, then the other ends.
"""

from __future__ import annotations

import logging

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets

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
#: Step of the difference quotients, in grid spacings.
STEP = 1e-3


def snap_feature_edges(mesh: TetMesh, first: Field, second: Field, spacing: float) -> TetMesh:
    """Move vertices onto the edge where two fields vanish together.

    Parameters
    ----------
    mesh : TetMesh
        Stuffed from ``max(first, second)``.
    first, second : callable
        Fields in about mm, negative inside.
    spacing : float, mm
        Grid spacing of the stuffing.

    Returns
    -------
    TetMesh
        Same connectivity; a vertex whose move would spoil a tetrahedron stays where it was.
    """
    fields = first, second
    crossing, near = _crossing_sides(mesh, fields, spacing)
    if len(crossing) == 0:
        return mesh
    points = np.array(mesh.points)
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
        _move(points, mesh.tets, movers, fields, spacing, snapped)
        if turn > 0:
            near[movers[~snapped[movers]]] = np.inf
    log.info(
        "snapped %d vertices, %d of %d chamfered sides left",
        np.count_nonzero(snapped), np.count_nonzero(~snapped[crossing].any(axis=1)), len(crossing),
    )  # fmt: skip
    return TetMesh(points=points, tets=mesh.tets)


def _move(
    points: FloatArray,
    tets: IntArray,
    movers: IntArray,
    fields: tuple[Field, Field],
    spacing: float,
    snapped: BoolArray,
) -> None:
    """Move vertices onto the edge in place, but for those that reach too far or spoil a tet."""
    before = points[:, movers].copy()
    target, sound = _onto_both(before, *fields, spacing)
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


def _crossing_sides(
    mesh: TetMesh, fields: tuple[Field, Field], spacing: float
) -> tuple[IntArray, FloatArray]:
    """Triangle sides from one face to the other, and how far every vertex is from their edge.

    Returns
    -------
    crossing : (k, 2) int array
    near : (n,) array, mm
        Of a vertex on one face the field of the other; infinite inside.
    """
    facets, _ = boundary_facets(mesh)
    used = np.unique(facets)
    first, second = (field(mesh.points[:, used]) for field in fields)
    near = np.full(mesh.points.shape[1], np.inf)
    near[used] = np.maximum(np.abs(first), np.abs(second))
    side = np.zeros(mesh.points.shape[1], dtype=np.int64)
    on_one, on_other = np.abs(first) <= ON_FACE * spacing, np.abs(second) <= ON_FACE * spacing
    side[used[on_one & ~on_other]] = 1
    side[used[on_other & ~on_one]] = 2
    ends = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
    ends = ends[ends[:, 0] < ends[:, 1]]
    return ends[side[ends].min(axis=1) * side[ends].max(axis=1) == 2], near


def _onto_both(
    points: FloatArray, first: Field, second: Field, spacing: float
) -> tuple[FloatArray, BoolArray]:
    """Newton steps of least length onto both zero sets; the mask says where they arrive."""
    position = np.array(points)
    for _ in range(4):
        value, gram, slopes = _linearised(position, first, second, spacing)
        det = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
        steep = det > np.maximum(1e-2 * gram[0, 0] * gram[1, 1], 1e-12)
        det = np.where(steep, det, 1.0)
        a = (gram[1, 1] * value[0] - gram[0, 1] * value[1]) / det
        b = (gram[0, 0] * value[1] - gram[0, 1] * value[0]) / det
        step = -(a * slopes[0] + b * slopes[1])
        length = np.linalg.norm(step, axis=0)
        step *= np.minimum(1.0, 0.5 * spacing / np.maximum(length, 1e-300))
        position += np.where(steep, step, 0.0)
    value, _, slopes = _linearised(position, first, second, spacing)
    size = np.linalg.norm(slopes, axis=1)
    reached = np.abs(value) <= 0.02 * spacing * size
    return position, np.asarray((reached & (size > 0)).all(axis=0))


def _linearised(
    points: FloatArray, first: Field, second: Field, spacing: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values ``(2, n)``, products of gradients ``(2, 2, n)`` and gradients ``(2, 3, n)``."""
    step = STEP * spacing
    slopes = np.zeros((2, *points.shape))
    for k, field in enumerate((first, second)):
        for d in range(3):
            shift = np.zeros((3, 1))
            shift[d] = step
            slopes[k, d] = (field(points + shift) - field(points - shift)) / (2 * step)
    value = np.stack([first(points), second(points)])
    return value, np.einsum("adn,bdn->abn", slopes, slopes), slopes


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
