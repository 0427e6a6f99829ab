"""Edges of cuboctahedra and octahedra, which fill space together.

Joins the middles of neighbouring edges of the cubic cell, 6 sqrt(2) cell lengths of strut in a
cell: the cuboctahedron inscribed in the cell, with octahedra at its corners. The rectified cubic
honeycomb.
"""

from __future__ import annotations

from gradedesign.fields import bond_graph
from gradedesign_cells_strut.strut_family import section_families

SOURCE = "edges of the cuboctahedron inscribed in the cubic cell (rectified cubic honeycomb)"

NODES, EDGES = bond_graph([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]], 0.5**0.5)

#: Cells of this graph.
FAMILIES = tuple(section_families("cuboctahedron", NODES, EDGES, SOURCE))
