"""The graphs whose convolutions are cells.

They are those of gradedesign-cells-strut, which explains each and names its source; distributions
do not import each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gradedesign.fields import FloatArray, bond_graph

#: Lengths of struts between neighbours, cell units: face diagonal, space diagonal, their halves.
_FACE, _SPACE = 0.5**0.5, 0.75**0.5

_CORNER = [[0.0, 0.0, 0.0]]
_MIDDLE = [[0.5, 0.5, 0.5]]
_FACES = [[0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]]
_EDGES = [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]
_EIGHTHS = [[x, y, z] for x in (0.25, 0.75) for y in (0.25, 0.75) for z in (0.25, 0.75)]
_TETRAHEDRON = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]]
_KELVIN = [
    site
    for a, b in ((0.25, 0.5), (0.75, 0.5), (0.5, 0.25), (0.5, 0.75))
    for site in ([0.0, a, b], [b, 0.0, a], [a, b, 0.0])
]


class Graph(NamedTuple):
    """A graph: ``nodes`` is ``(n, 3)`` in cell units, ``edges`` ``(m, 2)``."""

    name: str
    nodes: FloatArray
    edges: NDArray[np.int64]


def graphs() -> Iterator[Graph]:
    """Every graph of this distribution."""
    fcc = _to_corners(Graph("fcc", *bond_graph([*_CORNER, *_FACES], _FACE)))
    bcc = Graph("bcc", *bond_graph([*_CORNER, *_MIDDLE], _SPACE))
    both = bond_graph([*_CORNER, *_FACES, *_MIDDLE], [_FACE, _SPACE])
    yield Graph("sc", *bond_graph(_CORNER, 1.0))
    yield bcc
    yield _with_pillar("bccz", bcc)
    yield fcc
    yield _with_pillar("fccz", fcc)
    yield _to_corners(Graph("f2bcc", *both))
    yield Graph("octet", *bond_graph([*_CORNER, *_FACES], _FACE))
    yield Graph("kelvin", *bond_graph(_KELVIN, _FACE / 2))
    yield Graph("diamond", *bond_graph([*_CORNER, *_FACES, *_TETRAHEDRON], _SPACE / 2))
    yield Graph("cuboctahedron", *bond_graph(_EDGES, _FACE))
    yield Graph("rhombic-dodecahedron", *bond_graph([*_MIDDLE, *_EDGES, *_EIGHTHS], _SPACE / 2))


def _to_corners(graph: Graph) -> Graph:
    """Keep the struts that end at a corner of the cell."""
    corner = (graph.nodes[graph.edges] % 1 == 0).all(axis=2).any(axis=1)
    return graph._replace(edges=graph.edges[corner])


def _with_pillar(name: str, graph: Graph) -> Graph:
    """Add a strut along z through the corners."""
    count = len(graph.nodes)
    nodes = np.concatenate([graph.nodes, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    return Graph(name, nodes, np.concatenate([graph.edges, [[count, count + 1]]]))
