"""Facets of shells that lie on each other, with solid on both sides: where bodies touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.geometry.part._edges import sharing_sets
from gradedesign.geometry.part._nesting import facet_areas
from gradedesign.geometry.triangles.crossings import Contacts, find_contacts
from gradedesign.geometry.triangles.winding import winding_numbers

#: Beside a contact, solid is looked for this many margins away from it, on both sides. Chosen, not
#: measured.
_BESIDE = 10.0
#: Places of two patches in contact that are looked at, those of the largest facets. Chosen, not
#: measured.
_SAMPLES = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Touches:
    """Pairs of facets that lie on each other."""

    shells: IntArray  #: ``(2, k)``. Shell of the first and of the second facet of each pair.
    facets: IntArray  #: ``(2, k)``. Their numbers within their shells.
    #: ``(k,)``. 0 or 1: which of the two is in a patch of facets that is covered to the larger
    #: share.
    moves: IntArray
    area: FloatArray  #: ``(k,)``, mm^2.
    distance: FloatArray  #: ``(k,)``, mm.
    middle: FloatArray  #: ``(k, 3)``, mm.

    def matrix(self, count: int) -> BoolArray:
        """Which of so many shells have faces in common, ``(s, s)``."""
        touching = np.zeros((count, count), dtype=np.bool_)
        touching[self.shells[0], self.shells[1]] = True
        return touching | touching.T

    def chosen(self, mask: BoolArray) -> Touches:
        """Some of the pairs."""
        return Touches(
            shells=self.shells[:, mask],
            facets=self.facets[:, mask],
            moves=self.moves[mask],
            area=self.area[mask],
            distance=self.distance[mask],
            middle=self.middle[mask],
        )

    def among(self, shells: IntArray, count: int) -> Touches:
        """Pairs between some of the shells, renumbered."""
        number = np.full(count, -1, dtype=np.int64)
        number[shells] = np.arange(len(shells))
        numbered = Touches(
            shells=number[self.shells],
            facets=self.facets,
            moves=self.moves,
            area=self.area,
            distance=self.distance,
            middle=self.middle,
        )
        return numbered.chosen(np.asarray((numbered.shells >= 0).all(axis=0)))

    @property
    def movers(self) -> tuple[IntArray, IntArray]:
        """Shells and numbers in them of the facets that move where the pairs are parted."""
        column = np.arange(len(self.moves))
        return self.shells[self.moves, column], self.facets[self.moves, column]


def own_vertices(
    vertices: FloatArray, parts: Sequence[IntArray]
) -> tuple[FloatArray, list[IntArray]]:
    """Give every shell its own vertices, so that shells that touch stay apart."""
    points, facets, start = [], [], 0
    for part in parts:
        used, index = np.unique(part, return_inverse=True)
        points.append(vertices[used])
        facets.append(index.reshape(-1, 3) + start)
        start += len(used)
    return np.concatenate(points), facets


def find_touches(vertices: FloatArray, parts: Sequence[IntArray], margin: float) -> Touches:
    """Find facets of shells, or of one shell, that lie on each other between solid and solid.

    Facets on both sides of a wall without thickness lie on each other as well, between air and air:
    these are left out.

    ``vertices (n, 3)``, mm. ``parts``, each ``(k, 3)``: facets of each shell, outward, voids
    reversed; shells have no common vertices. ``margin``, mm: within which facets lie on each other.
    """
    faces = np.concatenate(parts)
    size = np.array([len(part) for part in parts])
    shell = np.repeat(np.arange(len(parts)), size)
    contacts = find_contacts(vertices, faces, margin)
    pair = np.stack([contacts.first, contacts.second])
    patch = _patches(faces, pair)
    corners = vertices[faces]
    between = _between_solids(corners, contacts, patch[pair], margin)
    areas = facet_areas(corners)
    covered = np.zeros((2, pair.shape[1]))
    for side in (0, 1):
        number = patch[pair[side]]
        total = np.bincount(patch[patch >= 0], areas[patch >= 0])
        covered[side] = np.bincount(number, contacts.area)[number] / total[number]
    found = Touches(
        shells=shell[pair],
        facets=pair - (np.cumsum(size) - size)[shell[pair]],
        moves=np.argmax(covered, axis=0),
        area=contacts.area,
        distance=contacts.distance,
        middle=contacts.middle,
    )
    return found.chosen(between)


def _patches(faces: IntArray, pair: IntArray) -> IntArray:
    """Number the sets of facets in contact that share corners, ``(m,)``; -1 for others."""
    used = np.unique(pair)
    number = np.full(len(faces), -1, dtype=np.int64)
    if len(used):
        row = np.repeat(np.arange(len(used)), 3)
        group = sharing_sets(row, faces[used].ravel(), len(used))
        number[used] = np.unique(group, return_inverse=True)[1]
    return number


def _between_solids(
    corners: FloatArray, contacts: Contacts, patch: IntArray, margin: float
) -> BoolArray:
    """Which contacts have solid on both sides: most of the largest of the same two patches."""
    _, group = np.unique(np.sort(patch, axis=0), axis=1, return_inverse=True)
    group = group.ravel()
    order = np.lexsort((-contacts.area, group))
    start = np.flatnonzero(np.diff(group[order], prepend=-1))
    rank = np.arange(len(order)) - np.repeat(start, np.diff(start, append=len(order)))
    chosen = order[rank < _SAMPLES]
    a, b, c = np.moveaxis(corners[contacts.first[chosen]], 1, 0)
    normal = np.cross(b - a, c - a)
    step = _BESIDE * margin * normal / np.linalg.norm(normal, axis=1)[:, None]
    middle = contacts.middle[chosen]
    beside = np.concatenate([middle + step, middle - step]).T
    solid = (winding_numbers(corners, beside) > 0.5).reshape(2, -1).all(axis=0)
    votes = np.bincount(group[chosen], np.where(solid, 1, -1))
    return np.asarray(votes[group] > 0)
