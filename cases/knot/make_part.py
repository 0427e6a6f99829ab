"""Make knot.stl: a tube along a trefoil knot, in a box of 51.1 x 48 x 29.9 mm.

Run ``python make_part.py`` in this folder; needs what gradedesign installs. Lengths in mm. The box
is that of the knot of Aremu et al. (2017), Additive Manufacturing 13, 138-148, table 2, whose shape
is not published.
"""

from pathlib import Path

import numpy as np
import trimesh  # noqa: TID253

SIZE = (51.1, 48.0, 29.9)
#: Radius of the tube before it is stretched to the box, over that of the knot's winding.
RADIUS = 0.5
ALONG, AROUND = 160, 28


def axis(t):
    """Points of the trefoil, ``(3, n)``."""
    return np.array([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)])


def tube():
    """Corners of the triangles, ``(n, 3, 3)``, outward by the right-hand rule."""
    t = 2 * np.pi * np.arange(ALONG) / ALONG
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    along = axis(t + 1e-5) - axis(t - 1e-5)
    side = np.cross(along.T, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, along.T)
    up /= np.linalg.norm(up, axis=1)[:, None]
    ring = side[:, None] * np.cos(turn)[:, None] + up[:, None] * np.sin(turn)[:, None]
    points = axis(t).T[:, None] + RADIUS * ring
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    points = (points - low) / (high - low) * SIZE
    a, b = points, np.roll(points, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return np.concatenate([np.stack(f, axis=2).reshape(-1, 3, 3) for f in ((a, c, d), (a, b, c))])


if __name__ == "__main__":
    corners = tube()
    triangles = np.arange(3 * len(corners)).reshape(-1, 3)
    surface = trimesh.Trimesh(corners.reshape(-1, 3), triangles, process=False)
    surface.export(Path(__file__).with_name("knot.stl"))
