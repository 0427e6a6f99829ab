"""A surface cut into shells that are manifold: at every edge, facets are paired around the solid.

Where bodies touch, or one touches itself, more than two facets meet at an edge. Going around it,
each wedge of solid lies between two of them; these are neighbours on one shell.
"""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._duplicates import copy_numbers
from gradedesign.geometry.part._edges import Edges, face_edges, linked_sets, shell_labels
from gradedesign.geometry.part._nesting import shell_volume

#: Facets at an edge that are turned against each other by less are coincident at most, radians:
#: a wedge of solid of half a degree is no part, and rounding turns narrow facets by so much.
_LARGEST_ANGLE = 0.01


def manifold_shells(
    vertices: FloatArray, faces: IntArray, *, tolerance: float, source: str
) -> tuple[FloatArray, IntArray, IntArray]:
    """Separate shells at edges of more than two facets, and at vertices where fans meet.

    Raises PartError if facets do not run along an edge as often one way as the other.

    ``vertices (n, 3)``, mm. ``faces (m, 3)``: consistently oriented. ``tolerance``, mm: within
    which facets coincide. Returns ``vertices (k, 3)``, mm: the same where each has one fan of
    facets; else one for each fan; ``faces (m, 3)``: in the same order; ``shell (m,)``: number of
    the shell of each facet; each closes by itself.
    """
    edges = face_edges(faces)
    label = shell_labels(edges, len(faces))
    _require_balance(vertices, edges, source)
    first, second = _paired_sides(vertices, faces, edges, label, tolerance)
    m = len(faces)
    # Corner k of facet f has the number k m + f; side k runs from corner k to the next.
    links = (
        np.concatenate([first, (first + m) % (3 * m)]),
        np.concatenate([(second + m) % (3 * m), second]),
    )
    fan = linked_sets(links, 3 * m)
    _, corner, vertex = np.unique(fan, return_index=True, return_inverse=True)
    if len(corner) == len(np.unique(faces)):
        return vertices, faces, label
    shell = linked_sets((first % m, second % m), m)
    return (
        vertices[faces.T.ravel()[corner]],
        vertex.ravel().reshape(3, m).T.astype(np.int64),
        shell,
    )


def _require_balance(vertices: FloatArray, edges: Edges, source: str) -> None:
    net = np.bincount(edges.edge_of, np.where(edges.forward, 1, -1))
    if net.any():
        wrong = np.flatnonzero(net)
        place = vertices[edges.ends[wrong]].mean(axis=1)
        listed = "; ".join(f"({p[0]:.4g}, {p[1]:.4g}, {p[2]:.4g}) mm" for p in place[:5])
        raise PartError(
            f"{source}: {len(wrong)} non-manifold edges at which the facets do not "
            f"close to a solid, at {listed}; separate or unite the touching bodies in CAD"
        )


def _paired_sides(
    vertices: FloatArray, faces: IntArray, edges: Edges, label: IntArray, tolerance: float
) -> tuple[IntArray, IntArray]:
    """Sides of facets that are neighbours, numbered as in `Edges`."""
    m = len(faces)
    order = np.argsort(edges.edge_of, kind="stable")
    start = np.concatenate([[0], np.cumsum(edges.count)[:-1]]).astype(np.int64)
    plain = start[edges.count == 2]
    first, second = [order[plain]], [order[plain + 1]]
    crowded = np.flatnonzero(edges.count > 2)
    outward = shell_volume(vertices, faces) >= 0.0
    preference = _preference(faces, label) if len(crowded) else label
    for edge in crowded.tolist():
        sides = order[start[edge] : start[edge] + edges.count[edge]]
        angle, width = _angles(vertices, faces, sides, edges.ends[edge], tolerance)
        ends = edges.forward[sides] == outward
        for group in _groups(label[sides % m], ends):
            rank = preference[sides[group] % m]
            pairs = _around(angle[group], width[group], ends[group], rank)
            first.append(sides[group[pairs[:, 0]]])
            second.append(sides[group[pairs[:, 1]]])
    return np.concatenate(first), np.concatenate(second)


def _angles(
    vertices: FloatArray, faces: IntArray, sides: IntArray, ends: IntArray, tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """Angles of the facets of some sides around their edge, and how far off they may be."""
    m = len(faces)
    origin, tip = vertices[ends]
    axis = (tip - origin) / np.linalg.norm(tip - origin)
    across = vertices[faces[sides % m, (sides // m + 2) % 3]] - origin
    across = across - np.outer(across @ axis, axis)
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    height = np.linalg.norm(across, axis=1)
    width = np.minimum(tolerance / np.maximum(height, tolerance), _LARGEST_ANGLE)
    return np.arctan2(across @ np.cross(axis, u), across @ u), width


def _preference(faces: IntArray, label: IntArray) -> IntArray:
    """Order in which coincident facets are paired, ``(m,)``.

    Copies of one facet by their number, others by what they hang together with: then of two bodies
    with the same end, one gets the first copies of all its facets.
    """
    copy, doubled = copy_numbers(faces)
    return np.where(doubled, copy, label)


def _groups(label: IntArray, ends: IntArray) -> list[IntArray]:
    """Sides at an edge that are paired among each other.

    Those of what hangs together elsewhere, if it closes here by itself; the rest together.
    """
    numbers, index = np.unique(label, return_inverse=True)
    net = np.bincount(index, np.where(ends, 1, -1))
    groups = [np.flatnonzero(index == k) for k in range(len(numbers)) if net[k] == 0]
    rest = np.flatnonzero(net[index] != 0)
    return [*groups, rest] if len(rest) else groups


def _around(angle: FloatArray, width: FloatArray, ends: IntArray, rank: IntArray) -> IntArray:
    """Pairs ``(k, 2)`` of facets between which solid lies, by angle around an edge.

    With rising angle, solid begins at facets that do not end it. Of facets that coincide, those
    that end it come first: then bodies touch there, and the solid of neither is cut off.
    """
    order = np.argsort(angle, kind="stable")
    gap = np.diff(np.append(angle[order], angle[order[0]] + 2.0 * np.pi))
    apart = gap > width[order] + width[np.roll(order, -1)]
    turn = (int(np.argmax(gap)) + 1) % len(order)
    order, apart = np.roll(order, -turn), np.roll(apart, -turn)
    cluster = np.concatenate([[0], np.cumsum(apart[:-1])])
    # What began last ends first: of those that coincide, the last in rank begins last.
    inner = np.where(ends, -rank, rank)
    order = order[np.lexsort((inner[order], ~ends[order], cluster))]
    begun: list[int] = []
    pairs: list[tuple[int, int]] = []
    done: set[int] = set()
    for k in (*order.tolist(), *order.tolist()):  # a wedge may reach beyond the first facet
        if k in done:
            continue
        if not ends[k]:
            if k not in begun:
                begun.append(k)
        elif begun:
            pairs.append((begun.pop(), k))
            done.update(pairs[-1])
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)
