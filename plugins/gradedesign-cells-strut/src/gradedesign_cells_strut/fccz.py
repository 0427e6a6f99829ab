"""Face-centred cubic struts with struts along z, FCCZ.

Both diagonals of every face and a strut along z at the corners, 6 sqrt(2) + 1 cell lengths of
strut in a cell. Some authors leave out the diagonals of the horizontal faces; these are here.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "both diagonals of every face of the cell, and struts along z at the corners"

_NODES, _BONDS = bond_graph(
    [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
    0.5**0.5,
)
# Only struts that end at a corner: face centres are not joined to each other.
_DIAGONALS = _BONDS[(_NODES[_BONDS] % 1 == 0).all(axis=2).any(axis=1)]

# One strut along z through the corners.
NODES = np.concatenate([_NODES, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
EDGES = np.concatenate([_DIAGONALS, [[len(_NODES), len(_NODES) + 1]]])

#: Cells of this graph.
FAMILIES = tuple(section_families("fccz", NODES, EDGES, SOURCE))
