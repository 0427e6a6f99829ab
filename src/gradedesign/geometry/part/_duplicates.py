"""Facets over the same three vertices: those written twice, and those of two bodies that touch."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import BoolArray, IntArray
from gradedesign.geometry.part._edges import face_edges, sharing_sets


def drop_duplicates(faces: IntArray) -> tuple[IntArray, int]:
    """Drop facets that a file holds twice, except where two bodies touch.

    Facets over the same three vertices belong to two bodies where every edge around them has an
    even number of facets with all of them: always if they face each other, and if they face the
    same way unless one of each closes as well. Returns ``faces (k, 3)``.

    ``faces (m, 3)``.
    """
    if len(np.unique(np.sort(faces, axis=1), axis=0)) == len(faces):
        return faces, 0
    kept = faces[~_surplus(faces)]
    for facing in (False, True):  # what faces each other is looked at without plain copies
        kept = kept[~_copies(kept, facing=facing)]
    return kept, len(faces) - len(kept)


def _copies(faces: IntArray, *, facing: bool) -> BoolArray:
    """Mark duplicate facets over the same vertices to drop, ``(m,)``.

    `facing` chooses between duplicates that face each other and duplicates that do not.
    """
    _, first, index, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    index = index.ravel()
    patch = _patches(
        faces[first], (count > 1) & ((np.bincount(index, _sense(faces)) == 0) == facing)
    )
    if not (patch >= 0).any():
        return np.zeros(len(faces), dtype=np.bool_)
    all_odd, single_odd = _odd_edges(faces[first], count, patch)
    both = all_odd <= single_odd if facing else all_odd < single_odd
    single = (patch >= 0) & ~np.append(both, False)[patch]
    gone = np.asarray(single[index])
    gone[first[single]] = False
    return gone


def _surplus(faces: IntArray) -> BoolArray:
    """Facets ``(m,)`` beyond those that have one turned the other way, where some have."""
    index = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)[1].ravel()
    ahead = _sense(faces) > 0
    pairs = np.minimum(np.bincount(index, ahead), np.bincount(index, ~ahead))[index]
    rank = np.where(ahead, _rank(index, ahead), _rank(index, ~ahead))
    return np.asarray((pairs > 0) & (rank >= pairs))


def facing_pairs(faces: IntArray, shell: IntArray) -> BoolArray:
    """Mark facets ``(m,)`` of a shell that lie on another facet of it turned the other way.

    Both go without opening the shell: it is folded onto itself there.

    ``faces (m, 3)``. ``shell (m,)``: of every facet.
    """
    key = np.column_stack([shell, np.sort(faces, axis=1)])
    index = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    sense = _sense(faces)
    ahead, back = np.bincount(index, sense > 0), np.bincount(index, sense < 0)
    pairs = np.minimum(ahead, back)[index]
    return np.asarray(np.where(sense > 0, _rank(index, sense > 0), _rank(index, sense < 0)) < pairs)


def copy_numbers(faces: IntArray) -> tuple[IntArray, BoolArray]:
    """How many facets before each have its corners and its sense, and which have any such twin."""
    key = np.column_stack([np.sort(faces, axis=1), _sense(faces)])
    index, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)[1:]
    index = index.ravel()
    return _rank(index, np.ones(len(faces), dtype=np.bool_)), np.asarray(count[index] > 1)


def _rank(index: IntArray, among: BoolArray) -> IntArray:
    """Number of facets with the same index that come before each, counted among ``among``."""
    order = np.argsort(index, kind="stable")
    before: IntArray = np.cumsum(among[order]) - among[order]
    start = np.concatenate([[True], np.diff(index[order]) != 0])
    offset = np.maximum.accumulate(np.where(start, before, 0))
    rank = np.zeros(len(index), dtype=np.int64)
    rank[order] = before - offset
    return rank


def _sense(faces: IntArray) -> IntArray:
    """+1 for facets that are an even permutation of their sorted corners, -1 for odd ones."""
    a, b, c = faces.T
    return np.where((a < b).astype(int) + (b < c) + (c < a) == 2, 1, -1)


def _patches(sets: IntArray, doubled: BoolArray) -> IntArray:
    """Number the doubled sets ``(s, 3)`` of facets that meet at edges; -1 for others."""
    edge_of = face_edges(sets).edge_of
    number = np.tile(np.arange(len(sets)), 3)
    side = doubled[number]
    group = sharing_sets(number[side], edge_of[side], len(sets))
    patch = np.full(len(sets), -1, dtype=np.int64)
    patch[doubled] = np.unique(group[doubled], return_inverse=True)[1]
    return patch


def _odd_edges(sets: IntArray, count: IntArray, patch: IntArray) -> tuple[IntArray, IntArray]:
    """Edges of every patch with an odd number of facets: with all its facets, and one of each."""
    edges = face_edges(sets)
    total = np.bincount(edges.edge_of, np.tile(count, 3)).astype(np.int64)
    side = np.tile(patch, 3) >= 0
    key = np.tile(patch, 3)[side] * np.int64(len(total)) + edges.edge_of[side]
    found, index = np.unique(key, return_inverse=True)
    surplus = np.bincount(index.ravel(), np.tile(count - 1, 3)[side]).astype(np.int64)
    of_patch, edge = found // len(total), found % len(total)
    patches = int(patch.max()) + 1
    return (
        np.bincount(of_patch, total[edge] % 2, patches).astype(np.int64),
        np.bincount(of_patch, (total[edge] - surplus) % 2, patches).astype(np.int64),
    )
