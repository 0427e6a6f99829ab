"""Welding of loose corners to shared vertices, without degenerate facets."""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import face_edges, linked_sets, odd_edge_count
from gradedesign.geometry.part._nesting import facet_areas

#: A gap this many times as wide as what lies on its one side cuts off what is on the other. Chosen,
#: not measured.
_GAP = 10.0
#: Share of the corners that may be astray. Chosen, not measured.
_STRAY_SHARE = 0.01
#: Flips for each facet without area, after which the rest is left as it is. Chosen, not measured.
_MOST_FLIPS = 20
#: Pairs of corners within the tolerance that fit in memory. Chosen, not measured.
_MOST_PAIRS = 20_000_000


def core_points(points: FloatArray) -> FloatArray:
    """Points ``(n, 3)`` without the few that lie far astray.

    Points are astray if a gap of ten times the diagonal of the rest, along an axis, lies between,
    and at most a hundredth of the points is on their side. Tolerances follow the size of the rest,
    so that one damaged facet far away does not weld the part into a lump.
    """
    while True:
        core = points[_near(points)]
        if len(core) == len(points):
            return points
        points = core


def _near(points: FloatArray) -> BoolArray:
    """Points that no wide gap along an axis cuts off, ``(n,)``."""
    few = max(3, int(_STRAY_SHARE * len(points)))
    for axis in range(3):
        place = points[:, axis]
        ordered = np.sort(place)
        gaps = np.diff(ordered)
        for cut in np.flatnonzero(gaps > np.ptp(place) / (2.0 * _GAP)).tolist():
            above = len(ordered) - 1 - cut
            if cut + 1 <= few < above:
                rest = place > ordered[cut]
            elif above <= few < cut + 1:
                rest = place <= ordered[cut]
            else:
                continue
            if gaps[cut] > _GAP * np.linalg.norm(np.ptp(points[rest], axis=0)):
                return np.asarray(rest)
    return np.ones(len(points), dtype=np.bool_)


def weld(corners: FloatArray, tolerance: float, source: str) -> tuple[FloatArray, IntArray, int]:
    """Join corners that coincide within a tolerance.

    Clusters come from a neighbour search, so no pair falls apart at a grid line. Each
    cluster keeps the coordinates of its first member: clean input stays bit-identical.

    Raises PartError if nearly all corners lie within the tolerance of each other.

    ``corners (m, 3, 3)``, mm. ``tolerance``, mm. ``source``: name for messages. Returns
    ``vertices (n, 3)``, mm; ``faces (m, 3)``; ``moved``: distinct points that were joined to
    another one.
    """
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    tree = cKDTree(points)
    near = (int(tree.count_neighbors(tree, tolerance)) - len(points)) // 2
    if near > _MOST_PAIRS:
        raise PartError(
            f"{source}: {near:.3g} pairs of corners lie within {tolerance:.3g} mm of each other, "
            "so most facets have no size beside the part; export it again with a coarser tolerance"
        )
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    if len(pairs) == 0:
        return points, index.reshape(-1, 3).astype(np.int64), 0
    cluster = linked_sets(pairs.T, len(points))
    _, first = np.unique(cluster, return_index=True)
    return points[first], cluster[index].reshape(-1, 3), len(points) - len(first)


def thickness(vertices: FloatArray) -> float:
    """Extent along the direction in which the points spread least, mm."""
    centred = vertices - vertices.mean(axis=0)
    _, directions = np.linalg.eigh(centred.T @ centred)
    along = centred @ directions[:, 0]
    return float(along.max() - along.min())


def drop_degenerate(vertices: FloatArray, faces: IntArray, diagonal: float) -> tuple[IntArray, int]:
    """Remove facets without area, keeping the surface closed.

    A facet with two equal corners just goes. One with three distinct corners on a line may be what
    holds its neighbours together; then the neighbour across its longest edge is split instead (an
    edge flip), which moves no geometry. Returns ``faces (k, 3)``.
    """
    a, b, c = faces.T
    distinct = faces[(a != b) & (b != c) & (c != a)]
    flat = facet_areas(vertices[distinct]) <= (1e-9 * diagonal) ** 2
    if flat.any():
        plain = distinct[~flat]
        edges = face_edges(distinct)
        stray = flat & (edges.count % 2 == 1)[edges.edge_of].reshape(3, -1).any(axis=0)
        flipped = _flip_flat(vertices, distinct[~stray], flat[~stray])
        # The set with the fewest open edges, and of these the one with the fewest flat facets.
        ways = (plain, flipped, distinct[~stray])
        best = min(ways, key=odd_edge_count)
        return best, len(faces) - len(plain)
    return distinct, len(faces) - len(distinct)


def _flip_flat(vertices: FloatArray, faces: IntArray, flat: BoolArray) -> IntArray:
    """Flip the longest edge of every flat facet into the facet behind it; flat ones go.

    Where both are flat and it is the longest edge of both, the flip leaves two flat facets with
    shorter edges, which are flipped in their turn.
    """
    result: list[tuple[int, int, int] | None] = [(f[0], f[1], f[2]) for f in faces.tolist()]
    owner = {(f[k], f[(k + 1) % 3]): i for i, f in enumerate(faces.tolist()) for k in range(3)}
    waiting = deque(np.flatnonzero(flat).tolist())
    pending = set(waiting)
    for _ in range(_MOST_FLIPS * len(waiting)):
        if not waiting:
            break
        i = waiting.popleft()
        a, c, b = _longest_first(vertices, result[i] or (0, 0, 0))
        j = owner.get((c, a))
        if j is None or result[j] is None:
            continue
        d = next(v for v in result[j] or () if v not in (a, c))
        if j in pending:
            if b == d or set(_longest_first(vertices, result[j] or (0, 0, 0))[:2]) != {a, c}:
                waiting.append(i)
                continue
            waiting.append(i)
        else:
            pending.discard(i)
        if d == b:  # the facet lies folded onto its neighbour's edge: both only cancel
            continue
        result[i], result[j] = (c, b, d), (b, a, d)
        for k in (i, j):
            f = result[k] or (0, 0, 0)
            owner.update({(f[m], f[(m + 1) % 3]): k for m in range(3)})
    return np.array([f for k, f in enumerate(result) if f and k not in pending], dtype=np.int64)


def _longest_first(vertices: FloatArray, face: tuple[int, int, int]) -> tuple[int, int, int]:
    """Rotate a facet so that its longest edge runs from the first to the second corner."""
    lengths = [np.linalg.norm(vertices[face[k]] - vertices[face[(k + 1) % 3]]) for k in range(3)]
    k = int(np.argmax(lengths))
    return face[k], face[(k + 1) % 3], face[(k + 2) % 3]


def compact(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Drop vertices that no facet uses."""
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(faces.shape).astype(np.int64)
