"""Make octant.stl: an eighth of a ball of 25 mm radius with flats at both poles of the axis z.

Its planes of symmetry lie in x = 0, y = 0 and z = 0.

Run ``python make_part.py`` in this folder; needs manifold3d, which gradedesign installs.
Lengths in mm.
"""

import struct
from pathlib import Path

import numpy as np
from manifold3d import Manifold  # noqa: TID253

RADIUS, SEGMENTS = 25.0, 96
#: Height of the flat above the centre; its radius is 4.4 mm.
FLAT = 24.61


def octant() -> Manifold:
    """What of the ball lies where x, y and z are positive, below the flat."""
    return Manifold.sphere(RADIUS, SEGMENTS) ^ Manifold.cube((RADIUS + 1, RADIUS + 1, FLAT))


def write_binary_stl(path: Path, solid: Manifold) -> None:
    """Write triangles with their normals."""
    mesh = solid.to_mesh()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    record = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")]
    )
    record["normal"], record["corners"] = normals, corners
    header = b"eighth of a ball, mm".ljust(80, b" ")
    path.write_bytes(header + struct.pack("<I", len(record)) + record.tobytes())


if __name__ == "__main__":
    part = octant()
    write_binary_stl(Path(__file__).with_name("octant.stl"), part)
    exact = np.pi / 6 * RADIUS**3 - np.pi / 12 * (RADIUS - FLAT) ** 2 * (2 * RADIUS + FLAT)
    print(f"{part.num_tri()} triangles, {part.volume():.1f} of {exact:.1f} mm^3")
