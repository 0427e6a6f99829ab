"""Make the stored cells of this distribution: run once.

Needs gradedesign-cells-strut, whose graphs and sections it voxelises.
"""

from pathlib import Path

import numpy as np

from gradedesign_cells_strut import gradedesign_cell_families

DATA = Path(__file__).parents[1] / "src" / "gradedesign_cells_voxel" / "data"
EDGE, COUNT = 30, 16

#: Radii of the circles inscribed in the triangles, cell units.
THIN, THICK = 0.045, 0.1

#: Radius of the Kelvin cell's struts, cell units, and voxels over which its grey values fall.
RADIUS, BAND = 0.08, 2.0


def main() -> None:
    """Write both files."""
    families = {family.name: family for family in gradedesign_cell_families()}
    axis = (np.arange(EDGE) + 0.5) / EDGE
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    radius = families["bcc-triangle"].shape(nodes).ravel()
    solid = radius <= np.linspace(THIN, THICK, COUNT)[:, None]
    np.savez_compressed(DATA / "bcc_triangle.npz", bits=np.packbits(solid, axis=1))
    depth = (RADIUS - families["kelvin"].shape(nodes)) * EDGE / BAND
    grey = np.clip(127.5 * (1 + depth), 0, 255).round().astype(np.uint8)
    np.savez_compressed(DATA / "kelvin.npz", grey=grey)


if __name__ == "__main__":
    main()
