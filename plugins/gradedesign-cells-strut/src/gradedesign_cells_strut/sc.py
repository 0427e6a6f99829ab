"""Simple cubic struts.

Struts along the edges of the cell, 3 cell lengths of strut in a cell. Stretched along the axes,
soft in shear. A cell of Aremu et al., Additive Manufacturing 13 (2017) 1-13.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import path_families, section_families

SOURCE = "struts along the edges of the cubic cell"

NODES, EDGES = bond_graph([[0.0, 0.0, 0.0]], 1.0)

#: Cells of this graph.
FAMILIES = (
    *section_families("sc", NODES, EDGES, SOURCE),
    *path_families("sc", NODES, EDGES, SOURCE),
)
