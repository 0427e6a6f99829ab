"""The Kelvin cell: edges of truncated octahedra.

Nodes at the permutations of (0, 1/4, 1/2), four struts at each, 6 sqrt(2) cell lengths of strut
in a cell. Zhu, Knott & Mills, Journal of the Mechanics and Physics of Solids 45 (1997) 319-343.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "edges of space-filling truncated octahedra"

NODES, EDGES = bond_graph(
    [
        site
        for a, b in ((0.25, 0.5), (0.75, 0.5), (0.5, 0.25), (0.5, 0.75))
        for site in ([0.0, a, b], [b, 0.0, a], [a, b, 0.0])
    ],
    0.125**0.5,
)

#: Cells of this graph.
FAMILIES = tuple(section_families("kelvin", NODES, EDGES, SOURCE))
