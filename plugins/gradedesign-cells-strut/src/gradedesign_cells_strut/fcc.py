"""Face-centred cubic struts.

Both diagonals of every face of the cell, 6 sqrt(2) cell lengths of strut in a cell: the octet
truss without its octahedron.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "both diagonals of every face of the cubic cell"

_NODES, _BONDS = bond_graph(
    [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
    0.5**0.5,
)
# Only struts that end at a corner: face centres are not joined to each other.
NODES, EDGES = _NODES, _BONDS[(_NODES[_BONDS] % 1 == 0).all(axis=2).any(axis=1)]

#: Cells of this graph.
FAMILIES = tuple(section_families("fcc", NODES, EDGES, SOURCE))
