"""Make octant.stl: an eighth of a ball of 25 mm radius with flats at both poles of the axis z.

Its planes of symmetry lie in x = 0, y = 0 and z = 0.

Run ``python make_part.py`` in this folder; needs what gradedesign installs.
Lengths in mm.
"""

from pathlib import Path

import numpy as np
import trimesh  # noqa: TID253
from manifold3d import Manifold  # noqa: TID253

RADIUS, SEGMENTS = 25.0, 96
#: Height of the flat above the centre; its radius is 4.4 mm.
FLAT = 24.61


def octant() -> Manifold:
    """What of the ball lies where x, y and z are positive, below the flat."""
    return Manifold.sphere(RADIUS, SEGMENTS) ^ Manifold.cube((RADIUS + 1, RADIUS + 1, FLAT))


if __name__ == "__main__":
    part = octant()
    mesh = part.to_mesh()
    surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
    surface.export(Path(__file__).with_name("octant.stl"))
    exact = np.pi / 6 * RADIUS**3 - np.pi / 12 * (RADIUS - FLAT) ** 2 * (2 * RADIUS + FLAT)
    print(f"{part.num_tri()} triangles, {part.volume():.1f} of {exact:.1f} mm^3")
