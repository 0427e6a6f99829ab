"""Shapes and STL files by script, clean and damaged, for tests of reading and repair."""

from __future__ import annotations

import struct

import manifold3d
import numpy as np

from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import corner_points

CUBE = corner_points(box_surface((20.0, 20.0, 20.0)))
#: What `ring` fills with more than one turn, mm^3; its 72 chords a turn lose up to 0.2 %.
ANNULUS = np.pi * (14.0**2 - 10.0**2) * 4.0


def corners_of(solid) -> np.ndarray:
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3][np.array(mesh.tri_verts).astype(int)]


def cube(*size) -> manifold3d.Manifold:
    return manifold3d.Manifold.cube(size)


def rod(height, radius, segments=32) -> manifold3d.Manifold:
    return manifold3d.Manifold.cylinder(height, radius, radius, segments)


def box(low, high, *, reverse=False) -> np.ndarray:
    """Corners of the box between two points."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    corners = corner_points(box_surface(tuple(high - low))) + low
    return corners[:, ::-1] if reverse else corners


def swept(stations: np.ndarray) -> np.ndarray:
    """Corners of a tube over closed polygons ``(k, m, 3)``, with flat ends, as one shell."""
    count, size = stations.shape[:2]
    facets = []
    for k in range(count - 1):
        for m in range(size):
            p, q = stations[k, m], stations[k, (m + 1) % size]
            r, s = stations[k + 1, m], stations[k + 1, (m + 1) % size]
            facets += [[p, q, s], [p, s, r]]
    for m in range(1, size - 1):
        facets.append([stations[0, 0], stations[0, m + 1], stations[0, m]])
        facets.append([stations[-1, 0], stations[-1, m], stations[-1, m + 1]])
    return np.array(facets)


def ring(turns: float, segments: int = 72) -> np.ndarray:
    """A bar of 4 x 4 mm swept around the z axis between 10 and 14 mm, as one shell."""
    phi = np.linspace(0.0, 2 * np.pi * turns, round(segments * turns) + 1)
    square = np.array([[10.0, 0.0], [10.0, 4.0], [14.0, 4.0], [14.0, 0.0]])
    return swept(
        np.stack(
            [
                np.outer(np.cos(phi), square[:, 0]),
                np.outer(np.sin(phi), square[:, 0]),
                np.tile(square[:, 1], (len(phi), 1)),
            ],
            axis=2,
        )
    )


def binary(corners, count=None) -> bytes:
    records = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    records["c"] = corners
    count = len(corners) if count is None else count
    return b"made by script".ljust(80) + struct.pack("<I", count) + records.tobytes()


def text(*shells) -> str:
    lines = []
    for corners in shells:
        lines.append("solid part")
        for facet in corners:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {p[0]:.8e} {p[1]:.8e} {p[2]:.8e}" for p in facet]
            lines += ["endloop", "endfacet"]
        lines.append("endsolid part")
    return "\n".join(lines) + "\n"
