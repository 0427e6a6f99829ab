"""Snap vertices of a stuffed mesh to the sharp edges of its solid.

Isosurface stuffing cuts off an edge between two faces, and fills the corner of a re-entrant one:
the surface triangle runs from a vertex on one face to a vertex on the other. Here one end of each
such triangle side is moved onto the edge. Where the faces are zero sets of two fields, the edge is
their intersection; the edges of a single distance are found from its gradients at both ends.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, Field, FloatArray, IntArray
from gradedesign.mesh._edge_moves import ON_FACE, move_onto_edge, sides_between, sides_of
from gradedesign.mesh.tet_mesh import TetMesh, boundary_facets

#: Step of the difference quotients, in grid spacings.
STEP = 1e-3
#: Faces of one distance whose normals differ by more meet in an edge, degrees.
EDGE_ANGLE = 30.0
#: A place on an edge lies this close to the surface, in grid spacings.
ON_EDGE = 0.03
#: Shortest gradient of a distance that is that of one face; of normals, the largest cosine between
#: opposite faces of a wall that has no edge.
ONE_FACE = 0.98
#: Of the triangles at a vertex, area of their sum over sum of their areas: those of one plane have
#: 1, those at an edge of `EDGE_ANGLE` that is chamfered 0.99.
PLANE = 0.998
#: Points on both faces that are tried next lie this much closer to the edge. A round face turns by
#: a quarter of the angle between them, which tells it from an edge.
CLOSER = 0.25


def snap_feature_edges(
    mesh: TetMesh,
    first: Field,
    second: Field,
    spacing: float,
    *,
    inside: Field | None = None,
    facets: IntArray | None = None,
) -> TetMesh:
    """Move vertices onto the edge where two fields vanish together.

    Parameters
    ----------
    mesh : TetMesh
        Stuffed from ``max(first, second)``, or from their minimum, whose edge is re-entrant.
    first, second : callable
        Fields in about mm, negative inside.
    spacing : float, mm
        Grid spacing of the stuffing.
    inside : callable, optional
        Of a field that trims both: only vertices and edges in its inside count.
    facets : (m, 3) int array, optional
        Boundary triangles of the mesh, where they are known.

    Returns
    -------
    TetMesh
        Same connectivity; a vertex whose move would spoil a tetrahedron stays where it was.
    """
    facets = boundary_facets(mesh)[0] if facets is None else facets
    used = np.unique(facets)
    if inside is not None:
        used = used[inside(mesh.points[:, used]) < -ON_FACE * spacing]
    one, other = (np.abs(field(mesh.points[:, used])) for field in (first, second))
    near = np.full(mesh.points.shape[1], np.inf)
    near[used] = np.maximum(one, other)
    side = np.zeros(mesh.points.shape[1], dtype=np.int64)
    on_one, on_other = one <= ON_FACE * spacing, other <= ON_FACE * spacing
    side[used[on_one & ~on_other]] = 1
    side[used[on_other & ~on_one]] = 2

    def targets(movers: IntArray) -> tuple[FloatArray, BoolArray]:
        place, sound = _onto_both(mesh.points[:, movers], first, second, spacing)
        if inside is not None:
            sound = sound & (inside(place) < 0)
        return place, sound

    return move_onto_edge(mesh, sides_between(facets, side), near, targets, spacing)


def snap_own_edges(
    mesh: TetMesh,
    distance: Field,
    inside: Field,
    spacing: float,
    *,
    facets: IntArray | None = None,
) -> TetMesh:
    """Move vertices onto the sharp edges of one distance field, convex and re-entrant ones.

    Parameters
    ----------
    mesh : TetMesh
        Stuffed from ``max(distance, inside)``.
    distance : callable
        Signed distance, mm, of a solid with smooth faces that meet in edges.
    inside : callable
        Field of what the distance trims: only vertices and edges in its inside count.
    spacing : float, mm
        Grid spacing of the stuffing.
    facets : (m, 3) int array, optional
        Boundary triangles of the mesh, where they are known.

    Returns
    -------
    TetMesh
        Same connectivity; a vertex whose move would spoil a tetrahedron stays where it was.

    Notes
    -----
    The target of a vertex is its foot on the line in which the tangent planes at both ends of the
    side meet, then those at points of both faces closer to the edge. It is used where the distance
    is less than `ON_EDGE` spacings there.
    """
    facets = boundary_facets(mesh)[0] if facets is None else facets
    used = _bent(mesh.points, facets)
    used = used[np.abs(distance(mesh.points[:, used])) <= ON_FACE * spacing]
    used = used[inside(mesh.points[:, used]) < -ON_FACE * spacing]
    normals, on_face = np.zeros(mesh.points.shape), np.zeros(mesh.points.shape[1], dtype=bool)
    normals[:, used], on_face[used] = _normals(distance, mesh.points[:, used], spacing)
    ends = sides_of(facets)
    ends = ends[on_face[ends].all(axis=1)]
    ends = ends[_meet(normals[:, ends[:, 0]], normals[:, ends[:, 1]])]
    place, near, other = _nearest_feet(mesh.points, normals, ends)
    movers = np.unique(ends)
    feet, sound = _along_curved_faces(
        distance, place[:, movers], mesh.points[:, movers], mesh.points[:, other[movers]], spacing
    )
    sound &= np.abs(distance(feet)) <= ON_EDGE * spacing
    sound &= inside(feet) < 0
    place[:, movers] = feet
    near[movers[~sound]] = np.inf

    def targets(movers: IntArray) -> tuple[FloatArray, BoolArray]:
        return place[:, movers], np.isfinite(near[movers])

    return move_onto_edge(mesh, ends, near, targets, spacing)


def _bent(points: FloatArray, facets: IntArray) -> IntArray:
    """Vertices around which the boundary's triangles are not in one plane."""
    a, b, c = points[:, facets.T].swapaxes(0, 1)
    area = np.cross(b - a, c - a, axis=0)
    size = np.linalg.norm(area, axis=0)
    total, count = np.zeros((3, points.shape[1])), np.zeros(points.shape[1])
    for corner in facets.T:
        count += np.bincount(corner, size, len(count))
        for d in range(3):
            total[d] += np.bincount(corner, area[d], len(count))
    return np.flatnonzero(np.linalg.norm(total, axis=0) < PLANE * count)


def _nearest_feet(
    points: FloatArray, normals: FloatArray, ends: IntArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Nearest foot of every vertex on the lines where the planes of its sides' ends meet.

    Returns
    -------
    place : (3, n) array, mm
    near : (n,) array, mm
        How far it is; infinite for vertices without a side.
    other : (n,) int array
        Other end of that side.
    """
    place, near = np.array(points), np.full(points.shape[1], np.inf)
    other = np.arange(points.shape[1])
    for here, there in (ends.T, ends.T[::-1]):
        a, b = points[:, here], points[:, there]
        foot = _foot(a, (a, normals[:, here]), (b, normals[:, there]))
        step = np.linalg.norm(foot - a, axis=0)
        # The shortest step of a vertex is written last.
        order = np.argsort(-step, kind="stable")
        order = order[step[order] < near[here[order]]]
        near[here[order]], other[here[order]] = step[order], there[order]
        place[:, here[order]] = foot[:, order]
    return place, near, other


def _along_curved_faces(
    distance: Field, feet: FloatArray, first: FloatArray, second: FloatArray, spacing: float
) -> tuple[FloatArray, BoolArray]:
    """Feet with the planes of points on both faces closer to the edge; the mask says where.

    ``feet``, ``first`` and ``second``, one point on each face, are ``(3, n)``, mm. What planes miss
    of a curved edge falls as the square of the distance from it.
    """
    sound = np.ones(feet.shape[1], dtype=bool)
    for _ in range(2):
        planes = []
        for end in (first, second):
            base = feet + CLOSER * (end - feet)
            normal, on_face = _normals(distance, base, spacing)
            planes.append((base - distance(base) * normal, normal))
            sound &= on_face
        first, second = planes[0][0], planes[1][0]
        sound &= _meet(planes[0][1], planes[1][1])
        feet = np.where(sound, _foot(feet, *planes), feet)
    return feet, sound


def _foot(
    start: FloatArray, first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Nearest points to ``start`` on both of two planes, each a point and a normal, ``(3, n)``."""
    (a, n), (b, m) = first, second
    cosine = np.einsum("dk,dk->k", n, m)
    square = np.maximum(1.0 - cosine**2, 1e-12)
    to_a, to_b = (np.einsum("dk,dk->k", q, p - start) for p, q in ((a, n), (b, m)))
    return start + (n * (to_a - cosine * to_b) + m * (to_b - cosine * to_a)) / square


def _meet(first: FloatArray, second: FloatArray) -> BoolArray:
    """Whether faces with these unit normals, ``(3, n)``, meet in an edge."""
    cosine = np.einsum("dk,dk->k", first, second)
    return np.asarray((cosine < np.cos(np.radians(EDGE_ANGLE))) & (cosine > -ONE_FACE))


def _normals(distance: Field, points: FloatArray, spacing: float) -> tuple[FloatArray, BoolArray]:
    """Unit gradients of a distance, ``(3, n)``, and where they are those of one face, ``(n,)``."""
    slopes = _gradient(distance, points, STEP * spacing)
    length = np.linalg.norm(slopes, axis=0)
    return slopes / np.maximum(length, 1e-300), length > ONE_FACE


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
    slopes = np.stack([_gradient(field, points, STEP * spacing) for field in (first, second)])
    value = np.stack([first(points), second(points)])
    return value, np.einsum("adn,bdn->abn", slopes, slopes), slopes


def _gradient(field: Field, points: FloatArray, step: float) -> FloatArray:
    """Gradient by central differences, ``(3, n)``."""
    shifts = step * np.eye(3)[:, :, None]
    return np.stack([field(points + shift) - field(points - shift) for shift in shifts]) / (
        2 * step
    )
