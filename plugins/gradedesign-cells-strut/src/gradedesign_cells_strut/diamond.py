"""Struts of the diamond lattice.

Bonds of the diamond lattice, four at each node, 4 sqrt(3) cell lengths of strut in a cell. Bent
in every direction. Maconachie et al., Materials & Design 183 (2019) 108137, reviews it.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "bonds of the diamond lattice"

_CUBE = ([0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5])
NODES, EDGES = bond_graph(
    [[c + shift for c in site] for shift in (0.0, 0.25) for site in _CUBE],
    0.1875**0.5,
)

#: Cells of this graph.
FAMILIES = tuple(section_families("diamond-strut", NODES, EDGES, SOURCE))
