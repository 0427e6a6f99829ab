"""Face- and body-centred cubic struts, F2BCC.

Two diagonals on every face and the struts of the body-centred cell, 6 sqrt(2) + 4 sqrt(3) cell
lengths of strut in a cell. The cell of the timings of Aremu et al., Additive Manufacturing 13
(2017) 1-13.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "both diagonals of every face, and struts from the middle to the corners"

_NODES, _BONDS = bond_graph(
    [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5], [0.5, 0.5, 0.5]],
    [0.5**0.5, 0.75**0.5],
)
# Only struts that end at a corner: face centres are not joined to each other.
NODES, EDGES = _NODES, _BONDS[(_NODES[_BONDS] % 1 == 0).all(axis=2).any(axis=1)]

#: Cells of this graph.
FAMILIES = tuple(section_families("f2bcc", NODES, EDGES, SOURCE))
