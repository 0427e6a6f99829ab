"""Seams of a surface: open edges on which corners of the facets beyond lie."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.geometry.part._edges import face_edges, odd_edge_count

#: Corners beside open edges that fit in memory; a surface with more is no part.
_MOST_CORNERS = 20_000_000
#: Open edges that are looked at together. Bounds the memory; the result does not depend on it.
#: Chosen, not measured.
_BATCH = 1 << 12


def join_seams(vertices: FloatArray, faces: IntArray, tolerance: float) -> tuple[IntArray, int]:
    """Split facets where corners of open edges lie on their own open edges.

    A writer that leaves out facets without area leaves edges that meet several shorter ones.
    Nothing is missing there; split, the facets meet edge by edge, and no point moves by more than
    the tolerance. Returns ``faces (k, 3)``: as they came where fewer edges would not be odd.

    ``vertices (n, 3)``, mm. ``faces (m, 3)``. ``tolerance``, mm.
    """
    edges = face_edges(faces)
    open_side = np.flatnonzero(edges.count[edges.edge_of] == 1)
    if len(open_side) == 0:
        return faces, 0
    m = len(faces)
    ends = edges.ends[edges.edge_of[open_side]]
    on_side = _corners_on(vertices, ends, tolerance)
    if not on_side:
        return faces, 0
    between = {tuple(sorted(ends[k].tolist())): corners for k, corners in on_side.items()}
    touched = np.unique([open_side[k] % m for k in on_side])
    made = [part for a, b, c in faces[touched].tolist() for part in _split((a, b, c), between)]
    joined = np.concatenate([np.delete(faces, touched, axis=0), np.array(made, dtype=np.int64)])
    if odd_edge_count(joined) >= odd_edge_count(faces):
        return faces, 0
    return joined, len(touched)


def _corners_on(vertices: FloatArray, ends: IntArray, tolerance: float) -> dict[int, list[int]]:
    """Corners of open edges on the edges ``(e, 2)``, from the first end to the second."""
    corners = np.unique(ends)
    tree = cKDTree(vertices[corners])
    start, along = vertices[ends[:, 0]], vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.linalg.norm(along, axis=1)
    on_edge: dict[int, list[int]] = {}
    looked_at = 0
    for first in range(0, len(ends), _BATCH):
        some = slice(first, first + _BATCH)
        middle, reach = start[some] + 0.5 * along[some], 0.5 * length[some] + tolerance
        looked_at += int(tree.query_ball_point(middle, reach, return_length=True).sum())
        if looked_at > _MOST_CORNERS:
            return {}
        for k, near in enumerate(tree.query_ball_point(middle, reach), first):
            candidates = corners[near]
            offset = vertices[candidates] - start[k]
            share = offset @ along[k] / length[k] ** 2
            off = np.linalg.norm(offset - share[:, None] * along[k], axis=1)
            inner = np.abs(share - 0.5) * length[k] < 0.5 * length[k] - tolerance
            inner &= (off <= tolerance) & (candidates != ends[k, 0]) & (candidates != ends[k, 1])
            if inner.any():
                order = np.argsort(share[inner])
                on_edge[k] = candidates[inner][order].tolist()
    return on_edge


def _split(
    face: tuple[int, int, int], between: dict[tuple[int, ...], list[int]]
) -> list[tuple[int, int, int]]:
    """Divide a facet at the corners ``between`` the ends of its edges, smaller ones first.

    A facet thinner than the tolerance, whose own corners lie on its edges, stays as it is.
    """
    a, b, c = face
    chains = []
    for p, q in ((a, b), (b, c), (c, a)):
        inner = between.get((min(p, q), max(p, q)), [])
        chains.append([p, *(inner if p < q else inner[::-1]), q])
    distinct = {corner for chain in chains for corner in chain}
    if len(distinct) < sum(len(chain) - 1 for chain in chains):
        return [face]
    pieces = [face]
    for chain in chains:
        for k, (x, y, z) in enumerate(pieces):
            for p, q, r in ((x, y, z), (y, z, x), (z, x, y)):
                if (p, q) == (chain[0], chain[-1]):
                    pieces[k : k + 1] = [(s, t, r) for s, t in pairwise(chain)]
                    break
            else:
                continue
            break
    return pieces
