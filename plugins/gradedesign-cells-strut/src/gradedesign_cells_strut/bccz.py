"""Body-centred cubic struts with struts along z, BCCZ.

As the body-centred cell, and a strut along z at the corners, 4 sqrt(3) + 1 cell lengths of strut
in a cell. Maconachie et al., Materials & Design 183 (2019) 108137, reviews it.
"""

from __future__ import annotations

import numpy as np

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "struts from the middle of the cell to its corners, and along z at the corners"

_NODES, _BONDS = bond_graph([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]], 0.75**0.5)

# One strut along z through the corners.
NODES = np.concatenate([_NODES, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
EDGES = np.concatenate([_BONDS, [[len(_NODES), len(_NODES) + 1]]])

#: Cells of this graph.
FAMILIES = tuple(section_families("bccz", NODES, EDGES, SOURCE))
