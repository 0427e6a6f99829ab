"""The octet truss.

All nearest neighbours of the face-centred cubic lattice, 12 sqrt(2) cell lengths of strut in a
cell; density 6 sqrt(2) pi (a / l)^2 for thin struts of radius a and length l. Deshpande, Fleck &
Ashby, Journal of the Mechanics and Physics of Solids 49 (2001) 1747-1769.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "nearest neighbours of the face-centred cubic lattice (Deshpande, Fleck, Ashby 2001)"

NODES, EDGES = bond_graph(
    [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
    0.5**0.5,
)

#: Cells of this graph.
FAMILIES = tuple(section_families("octet", NODES, EDGES, SOURCE))
