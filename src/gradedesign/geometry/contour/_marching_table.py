"""The triangles of a cube for each of its 256 corner signs, derived rather than typed in.

The contour of every cube is traced on its faces first: crossings are joined face by face, with
one rule for ambiguous faces that depends on the signs of that face alone, so two cubes always
agree on the face they share. Each closed loop is then triangulated without a diagonal that lies
in a cube face. Such a triangulation exists for all 256 cases (built here, tested), and it is what
makes the surface a manifold: a contour segment belongs to exactly one loop of each of its two
cubes, any other triangle edge to one loop of one cube, and the triangles round a grid edge close
to a single fan.

Source: the tracing is the standard one of Lorensen and Cline (1987); the remark on diagonals in
cube faces follows from the counting above.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Corner = tuple[int, int, int]

#: Axis and base corner of the twelve edges of the unit cube.
EDGES: tuple[tuple[int, Corner], ...] = (
    *((0, (0, j, k)) for k in (0, 1) for j in (0, 1)),
    *((1, (i, 0, k)) for k in (0, 1) for i in (0, 1)),
    *((2, (i, j, 0)) for j in (0, 1) for i in (0, 1)),
)


def corner_number(corner: Corner) -> int:
    """Bit of a corner in the case number: ``i + 2 j + 4 k``."""
    i, j, k = corner
    return i + 2 * j + 4 * k


def _edge_number(a: Corner, b: Corner) -> int:
    axis = next(n for n in range(3) if a[n] != b[n])
    return EDGES.index((axis, min(a, b)))


def _face_rings() -> list[list[Corner]]:
    """Corners of the six faces, counter-clockwise seen from outside the cube."""
    rings = []
    for axis in range(3):
        for side in (0, 1):
            ring = []
            for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = [0, 0, 0]
                corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = side, x, y
                ring.append((corner[0], corner[1], corner[2]))
            rings.append(ring if side else ring[::-1])
    return rings


_RINGS = _face_rings()
_FACE_EDGES = [frozenset(_edge_number(r[n], r[(n + 1) % 4]) for n in range(4)) for r in _RINGS]


def face_segments(case: int, ring: list[Corner]) -> list[tuple[int, int]]:
    """Directed contour segments on one face, as pairs of cube edges.

    Inside corners lie on the segment's left, seen from outside the cube. On an ambiguous face
    (signs alternate) the inside corners are joined, so a wall that is barely resolved stays whole.
    """
    inside = [bool(case >> corner_number(c) & 1) for c in ring]
    edge = [_edge_number(ring[n], ring[(n + 1) % 4]) for n in range(4)]
    entering = [n for n in range(4) if not inside[n] and inside[(n + 1) % 4]]
    leaving = [n for n in range(4) if inside[n] and not inside[(n + 1) % 4]]
    if len(entering) == 2:
        return [(edge[n], edge[(n - 1) % 4]) for n in entering]
    return [(edge[a], edge[b]) for a, b in zip(entering, leaving, strict=True)]


def contour_loops(case: int) -> list[list[int]]:
    """Closed loops of cube edges that bound the surface inside a cube."""
    follow = dict(segment for ring in _RINGS for segment in face_segments(case, ring))
    loops: list[list[int]] = []
    while follow:
        loop = [min(follow)]
        while (after := follow.pop(loop[-1])) != loop[0]:
            loop.append(after)
        loops.append(loop)
    return loops


def _midpoint(edge: int) -> NDArray[np.float64]:
    axis, base = EDGES[edge]
    point = np.array(base, dtype=np.float64)
    point[axis] = 0.5
    return point


def _diagonal_cost(a: int, b: int) -> float:
    if any(a in face and b in face for face in _FACE_EDGES):
        return np.inf
    return float(np.linalg.norm(_midpoint(a) - _midpoint(b)))


def _triangulate_loop(loop: list[int]) -> tuple[tuple[int, int, int], ...]:
    """Triangles over a loop with the shortest diagonals, none of them in a cube face.

    Raises ValueError if every triangulation has a diagonal in a cube face (happens for no case).
    """
    n = len(loop)

    @cache
    def best(i: int, j: int) -> tuple[float, tuple[tuple[int, int, int], ...]]:
        if j - i < 2:
            return 0.0, ()
        own = 0.0 if j - i == n - 1 else _diagonal_cost(loop[i], loop[j])
        options = (
            (
                best(i, k)[0] + best(k, j)[0],
                (*best(i, k)[1], *best(k, j)[1], (loop[i], loop[k], loop[j])),
            )
            for k in range(i + 1, j)
        )
        cost, triangles = min(options)
        return cost + own, triangles

    cost, triangles = best(0, n - 1)
    if not np.isfinite(cost):
        raise ValueError(f"loop {loop} has no triangulation off the cube's faces")
    return triangles


@cache
def marching_table() -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Triangles of all cases.

    Returns ``triangles (256, 5, 3)``: cube edges of every triangle, outward oriented; unused rows
    are -1; ``counts (256,)``: number of triangles of each case.
    """
    triangles = np.full((256, 5, 3), -1, dtype=np.int8)
    counts = np.zeros(256, dtype=np.int8)
    for case in range(256):
        case_triangles = [t for loop in contour_loops(case) for t in _triangulate_loop(loop)]
        counts[case] = len(case_triangles)
        if case_triangles:
            triangles[case, : len(case_triangles)] = case_triangles
    triangles.flags.writeable = False
    counts.flags.writeable = False
    return triangles, counts
