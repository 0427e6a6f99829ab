"""Separate parts of a stuffed solid that touch in a point or along an edge only.

Such pinches appear where the field is finer than the lattice. Left alone, an edge of the boundary
has four facets and stiffness hangs on a hinge. The parts get vertices of their own instead, at
the same place.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.mesh._stuffing_pinches_kernels import mark_pinches


def _link() -> tuple[IntArray, IntArray]:
    """Tetrahedra and faces around a point of the body-centred cubic lattice.

    Returns
    -------
    triangles : (24, 3) int array
        The three other corners of each tetrahedron, as numbers of neighbours.
    edges : (36, 4) int array
        The two other corners of each face, and the two tetrahedra beside it.
    """
    place = [tuple(s * 2 * (a == axis) for a in range(3)) for axis in range(3) for s in (-1, 1)]
    place += [tuple(2 * ((q >> a) & 1) - 1 for a in range(3)) for q in range(8)]
    square = [[sum((x - y) ** 2 for x, y in zip(p, q, strict=True)) for q in place] for p in place]
    triangles = [
        (a, b, c)
        for a in range(6)
        for b in range(6, 14)
        for c in range(b + 1, 14)
        if square[a][b] == 3 and square[a][c] == 3 and square[b][c] == 4
    ]
    beside: dict[tuple[int, int], list[int]] = {}
    for f, (a, b, c) in enumerate(triangles):
        for pair in ((a, b), (a, c), (b, c)):
            beside.setdefault(pair, []).append(f)
    return np.array(triangles), np.array([(*pair, *both) for pair, both in beside.items()])


TRIANGLES, EDGES = _link()


def find_pinches(
    node_vertex: NDArray[np.int32],
    sign: NDArray[np.int8],
    offsets: IntArray,
    layers: int,
    vertices: int,
) -> IntArray:
    """Vertices of lattice points where the solid is not one regular piece, ``(k,)``."""
    pinched = np.zeros(vertices, dtype=np.bool_)
    mark_pinches(node_vertex, sign, offsets, TRIANGLES, EDGES, layers, pinched)
    return np.flatnonzero(pinched)


class _Patch:
    """The tetrahedra around the pinches while they are being taken apart."""

    def __init__(self, points: FloatArray, tets: IntArray, pinches: IntArray) -> None:
        self.rows = np.flatnonzero(np.isin(tets, pinches).any(axis=1))
        self.tets: list[list[int]] = tets[self.rows].tolist()
        self.points = points
        self.added: list[FloatArray] = []
        self.users: dict[int, set[int]] = {}
        for row, tet in enumerate(self.tets):
            self._use(row, tet)

    def _use(self, row: int, tet: list[int]) -> None:
        for v in tet:
            self.users.setdefault(v, set()).add(row)

    def place(self, v: int) -> FloatArray:
        """Position of a vertex, old or added."""
        count = len(self.points)
        return self.points[v] if v < count else self.added[v - count]

    def add(self, point: FloatArray) -> int:
        """Number of a new vertex."""
        self.added.append(point)
        return len(self.points) + len(self.added) - 1

    def swap(self, row: int, old: int, new: int) -> None:
        """Replace one vertex of a tetrahedron."""
        self.users[old].discard(row)
        self.tets[row][self.tets[row].index(old)] = new
        self.users.setdefault(new, set()).add(row)

    def halve(self, row: int, v: int, w: int, middle: int) -> None:
        """Split a tetrahedron at the middle of its edge v, w."""
        second = [middle if x == v else x for x in self.tets[row]]
        self.swap(row, w, middle)
        self.tets.append(second)
        self._use(len(self.tets) - 1, second)

    def groups(self, *shared: int) -> list[list[int]]:
        """Tetrahedra that contain ``shared``, grouped by common facets that contain it too."""
        star = sorted(set.intersection(*(self.users[v] for v in shared)))
        label = {row: row for row in star}
        owner: dict[tuple[int, ...], int] = {}
        for row in star:
            apices = sorted(set(self.tets[row]).difference(shared))
            for left_out in apices:
                facet = tuple(x for x in apices if x != left_out)
                old, new = label[row], label[owner.setdefault(facet, row)]
                if old != new:
                    label = {r: new if g == old else g for r, g in label.items()}
        return [[r for r in star if label[r] == g] for g in dict.fromkeys(label.values())]


def separate_pinches(
    points: FloatArray, tets: IntArray, pinches: IntArray
) -> tuple[FloatArray, IntArray]:
    """Give parts that meet only in a vertex, or only along an edge, vertices of their own.

    Parameters
    ----------
    points : (n, 3) array, mm
    tets : (m, 4) int array
    pinches : (k,) int array
        Vertices to look at.

    Returns
    -------
    points, tets : arrays
        Every edge of the boundary has two facets if ``pinches`` named all that had more. Where
        two parts that touch along an edge also hold together elsewhere at both of its ends, the
        edge is split at its middle, which each part gets for itself.
    """
    patch = _Patch(points, tets, pinches)
    suspects = set(pinches.tolist())
    for v in sorted(suspects):
        for group in patch.groups(v)[1:]:
            twin = patch.add(points[v])
            suspects.add(twin)
            for row in group:
                patch.swap(row, v, twin)
    edges = {
        (v, w)
        for tet in patch.tets
        for v in tet
        for w in tet
        if v < w and v in suspects and w in suspects
    }
    for v, w in sorted(edges):
        groups = patch.groups(v, w)
        for group in groups if len(groups) > 1 else ():
            middle = patch.add(0.5 * (patch.place(v) + patch.place(w)))
            for row in group:
                patch.halve(row, v, w, middle)
    old = len(patch.rows)
    tets = tets.copy()
    tets[patch.rows] = np.array(patch.tets[:old], dtype=tets.dtype).reshape(-1, 4)
    more = np.array(patch.tets[old:], dtype=tets.dtype).reshape(-1, 4)
    extra = np.array(patch.added, dtype=np.float64).reshape(-1, 3)
    return np.concatenate([points, extra]), np.concatenate([tets, more])
