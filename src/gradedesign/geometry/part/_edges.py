"""Edges of a triangle surface: which facets meet where, and whether they close."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.errors import PartError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Edges:
    """Undirected edges of a surface and the facets around them."""

    count: IntArray  #: ``(e,)``. Facets at each edge: 1 is open, 2 is manifold.
    ends: IntArray  #: ``(e, 2)``. Vertices, the smaller first.
    #: ``(3 m,)``. Edge of each facet side; side ``k * m + f`` is facet f's edge from corner k to k
    #: + 1.
    edge_of: IntArray
    #: ``(3 m,)``. Whether the facet runs along the edge from its smaller vertex to its larger.
    forward: BoolArray
    pairs: IntArray  #: ``(p, 2)``. Facets on both sides of every manifold edge.
    pair_edge: IntArray  #: ``(p,)``. Those edges.
    #: ``(p,)``. Whether the two facets run along the edge in opposite ways, as they should.
    pair_consistent: BoolArray


def face_edges(faces: IntArray) -> Edges:
    """Find the edges of facets ``(m, 3)``."""
    m = len(faces)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = sides.min(axis=1), sides.max(axis=1)
    n = np.int64(faces.max() + 1 if m else 1)
    key, edge_of, count = np.unique(low * n + high, return_inverse=True, return_counts=True)
    edge_of = edge_of.astype(np.int64)
    forward = sides[:, 0] < sides[:, 1]
    order = np.argsort(edge_of, kind="stable")
    start = np.concatenate([[0], np.cumsum(count)[:-1]]).astype(np.int64)
    pair_edge = np.flatnonzero(count == 2)
    left, right = order[start[pair_edge]], order[start[pair_edge] + 1]
    return Edges(
        count=count,
        ends=np.stack([key // n, key % n], axis=1),
        edge_of=edge_of,
        forward=forward,
        pairs=np.stack([left % m, right % m], axis=1) if m else np.zeros((0, 2), dtype=np.int64),
        pair_edge=pair_edge,
        pair_consistent=forward[left] != forward[right],
    )


def odd_edge_count(faces: IntArray) -> int:
    """Count edges with an odd number of facets: 0 for a surface that can be closed."""
    return int(np.count_nonzero(face_edges(faces).count % 2))


def linked_sets(pairs: ArrayLike, size: int) -> IntArray:
    """Number the sets of things that pairs ``(2, k)`` connect, ``(size,)``."""
    first, second = np.asarray(pairs)
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(size, size))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def sharing_sets(owner: IntArray, shared: IntArray, size: int) -> IntArray:
    """Number the sets of things that have something in common, from pairs of both, ``(size,)``."""
    most = int(shared.max()) + 1 if len(shared) else 0
    return linked_sets((owner, size + shared), size + most)[:size]


def split_by(label: IntArray, values: NDArray[Any], count: int = 0) -> list[NDArray[Any]]:
    """Values (n, ...) of every label ``(n,)``, in their order; of so many labels at least."""
    ends = np.cumsum(np.bincount(label, minlength=count))[:-1]
    return np.split(values[np.argsort(label, kind="stable")], ends)


def shell_labels(edges: Edges, size: int) -> IntArray:
    """Number the sets of facets that hang together across manifold edges, ``(m,)``."""
    return linked_sets(edges.pairs.T, size)


def orient_consistently(vertices: FloatArray, faces: IntArray, source: str) -> tuple[IntArray, int]:
    """Flip the minority of each shell so that every manifold edge is run along both ways.

    Every facet gets two nodes, as it is and flipped; an edge joins the nodes that agree. A
    shell then falls into two halves, the two ways to orient it, or into one if it is one-sided.

    Raises PartError if a shell is one-sided, like a Moebius strip. Returns ``faces (m, 3)``.
    """
    edges = face_edges(faces)
    if edges.pair_consistent.all():
        return faces, 0
    m = len(faces)
    first, second = edges.pairs.T
    twist = np.where(edges.pair_consistent, 0, m)
    rows = np.concatenate([first, first + m])
    columns = np.concatenate([second + twist, second + m - twist])
    half = linked_sets((rows, columns), 2 * m)
    one_sided = half[:m] == half[m:]
    if one_sided.any():
        place = vertices[faces[one_sided]].mean(axis=(0, 1))
        raise PartError(
            f"{source}: {np.count_nonzero(one_sided)} facets around ({place[0]:.4g}, "
            f"{place[1]:.4g}, {place[2]:.4g}) mm form a one-sided surface (Moebius strip), "
            "which encloses nothing; repair the part in CAD"
        )
    shell = shell_labels(edges, m)
    # The half that holds a shell's first facet unflipped is its reference.
    _, start = np.unique(shell, return_index=True)
    flip = half[:m] != half[start][shell]
    share = np.bincount(shell, weights=flip) / np.bincount(shell)
    flip ^= share[shell] > 0.5
    return np.where(flip[:, None], faces[:, ::-1], faces), int(np.count_nonzero(flip))
