"""Cells stored as voxels: Aremu's triangular struts in increments, and a Kelvin cell.

``bcc-triangle-increments``: struts of triangular section along the space diagonals in sixteen
increments from thin to thick, each of 30 x 30 x 30 voxels of two values, as in Aremu et al. 2017,
table 1 and fig. 22 (30 voxels per cell in all of the paper's timings). The density selects.

``kelvin-voxel``: struts along the edges of a truncated octahedron as 8-bit grey values that fall
with the distance from the surface over two voxels, in 30 x 30 x 30 voxels (Raymont 2011, section
3.7: a distance-functioned volume, as a scan would be).

``scripts/make_data.py`` made both files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gradedesign_cells_voxel.increments import cell_from_nested_increments
from gradedesign_cells_voxel.voxel_cell import cell_from_voxels

DATA = Path(__file__).parent / "data"

#: Voxels along the edge of the increments.
EDGE = 30


def increments() -> NDArray[np.bool_]:
    """Voxels of the increments, ``(16, 30, 30, 30)``, True where solid."""
    with np.load(DATA / "bcc_triangle.npz", allow_pickle=False) as file:
        packed = file["bits"]
    return np.unpackbits(packed, axis=1, count=EDGE**3).astype(bool).reshape(-1, *[EDGE] * 3)


#: Cells of these files.
FAMILIES = (
    cell_from_nested_increments(
        tuple(increments()),
        name="bcc-triangle-increments",
        symmetry="none",
        source="triangular struts along the space diagonals, thin to thick, 30 voxels",
    ),
    cell_from_voxels(
        DATA / "kelvin.npz",
        name="kelvin-voxel",
        symmetry="cubic",
        source="Kelvin cell of 30 grey voxels (Raymont 2011, section 3.7)",
    ),
)
