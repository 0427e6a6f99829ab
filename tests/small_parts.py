"""Cells and cases that several folders of tests build on."""

import numpy as np

from gradedesign.cell.family import CellFamily

#: Plates on the faces of the cell, a true distance.
WALLS = CellFamily(
    name="walls",
    shape=lambda u: np.abs(u - np.round(u)).min(axis=0),
    distance=True,
    open_void=False,
)

#: A box of two cells of 8 mm between two solid ends, which a run needs seconds for; tables of
#: the load case, limits and lattice follow.
SHORT_BAR = """
[case]
name = "short bar"
[part]
box = ["16 mm", "8 mm", "8 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "root"
margin = "1.5 mm"
[[keep]]
region = "tip"
margin = "1.5 mm"
"""
