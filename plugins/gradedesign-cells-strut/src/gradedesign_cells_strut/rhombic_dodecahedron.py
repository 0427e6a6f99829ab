"""Edges of rhombic dodecahedra, which fill space.

The dodecahedra stand about the nodes of a face-centred cubic lattice; struts join the holes
between those, eight or four at a node, 8 sqrt(3) cell lengths of strut in a cell. Babaee et al.,
Acta Materialia 60 (2012) 2873-2885.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "edges of space-filling rhombic dodecahedra"

_EIGHT = [[0.5, 0.5, 0.5], [0.0, 0.0, 0.5], [0.0, 0.5, 0.0], [0.5, 0.0, 0.0]]
_FOUR = [[x, y, z] for x in (0.25, 0.75) for y in (0.25, 0.75) for z in (0.25, 0.75)]
NODES, EDGES = bond_graph([*_EIGHT, *_FOUR], 0.1875**0.5)

#: Cells of this graph.
FAMILIES = tuple(section_families("rhombic-dodecahedron", NODES, EDGES, SOURCE))
