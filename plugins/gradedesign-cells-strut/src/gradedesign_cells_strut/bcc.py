"""Body-centred cubic struts.

Struts from the middle of the cell to its corners, 4 sqrt(3) cell lengths of strut in a cell. Bent
by loads along the axes. The "X" cell of Tang et al., Proceedings of CAD'19, 69-74.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import path_families, section_families

SOURCE = "struts from the middle of the cubic cell to its corners"

NODES, EDGES = bond_graph([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]], 0.75**0.5)

#: Cells of this graph.
FAMILIES = (
    *section_families("bcc", NODES, EDGES, SOURCE),
    *path_families("bcc", NODES, EDGES, SOURCE),
)
