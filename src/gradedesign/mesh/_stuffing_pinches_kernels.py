"""Compiled search for lattice points and edges on which parts of a stuffed solid only touch."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True)
def _regions(signs, triangles, edges, solid, label):
    """Count the face-connected regions of solid around a surface point; solid is by triangle.

    ``signs`` belong to the 14 neighbours, ``triangles`` are the 24 lattice tetrahedra around the
    point (three neighbours each), ``edges`` the 36 faces between two of them.
    """
    regions = 0
    for f in range(24):
        a, b, c = signs[triangles[f, 0]], signs[triangles[f, 1]], signs[triangles[f, 2]]
        solid[f] = min(a, b, c) < 0
        label[f] = f
        regions += solid[f]
    for e in range(36):
        if not _joined(signs, edges, e, solid):
            continue
        a, b = label[edges[e, 2]], label[edges[e, 3]]
        if a != b:
            regions -= 1
            for f in range(24):
                if label[f] == b:
                    label[f] = a
    return regions


@njit(cache=True)
def _joined(signs, edges, e, solid):
    """Whether the two tetrahedra beside face e are solid and share solid on that face."""
    a, b = signs[edges[e, 0]], signs[edges[e, 1]]
    return (min(a, b) < 0 or (a == 0 and b == 0)) and solid[edges[e, 2]] and solid[edges[e, 3]]


@njit(cache=True)
def _pinched_edge(signs, triangles, edges, solid):
    """Whether solid touches itself along one of the lattice edges at a surface point."""
    for w in range(14):
        if signs[w] != 0:
            continue
        arcs = 0
        for f in range(24):
            if solid[f] and (triangles[f, 0] == w or triangles[f, 1] == w or triangles[f, 2] == w):
                arcs += 1
        for e in range(36):
            if (edges[e, 0] == w or edges[e, 1] == w) and _joined(signs, edges, e, solid):
                arcs -= 1
        if arcs > 1:
            return True
    return False


@njit(cache=True, parallel=True, nogil=True)
def mark_pinches(node_vertex, sign, offsets, triangles, edges, layers, pinched):
    """Mark the vertices where the solid around a lattice point is not one regular piece."""
    size = len(sign) // layers
    for i in prange(layers):
        signs = np.zeros(14, dtype=np.int8)
        solid = np.zeros(24, dtype=np.bool_)
        label = np.zeros(24, dtype=np.int64)
        for v in range(i * size, (i + 1) * size):
            if sign[v] != 0 or node_vertex[v] < 0:
                continue
            for d in range(14):
                signs[d] = sign[v + offsets[v & 1, d]]
            if _regions(signs, triangles, edges, solid, label) > 1 or _pinched_edge(
                signs, triangles, edges, solid
            ):
                pinched[node_vertex[v]] = True
