"""Turning facets so that neighbours agree on which side is outside."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray
from gradedesign.errors import PartError
from gradedesign.geometry.part._edges import Edges, face_edges, linked_sets


def shell_labels(edges: Edges, size: int) -> IntArray:
    """Number the sets of facets that hang together across manifold edges, ``(m,)``."""
    return linked_sets(edges.pairs.T, size)


def orient_consistently(vertices: FloatArray, faces: IntArray, source: str) -> tuple[IntArray, int]:
    """Flip the minority of each shell so that every manifold edge is run along both ways.

    Every facet gets two nodes, as it is and flipped; an edge joins the nodes that agree. A
    shell then falls into two halves, the two ways to orient it, or into one if it is one-sided.

    Returns
    -------
    faces : (m, 3) int array

    Raises
    ------
    PartError
        If a shell is one-sided, like a Moebius strip.
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
