"""Even random points on faces of a part, and the distance to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.geometry.triangles.surface_mesh import corner_points

#: Places on faces, and the seed that picks them. Any fixed seed, so that a run can be repeated.
#: Chosen, not measured.
PLACES, _SEED = 20_000, 1414


def face_places(part: Part, faces: Sequence[str] = ()) -> tuple[FloatArray, FloatArray]:
    """Even random points on regions, or on the whole surface, and the inward normals there.

    Both ``(3, n)``, mm.
    """
    corners = (
        np.concatenate([part.regions[name].corners for name in faces])
        if faces
        else corner_points(part.surface)
    )
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    random = np.random.default_rng(_SEED)
    chosen = random.choice(len(area), size=PLACES, p=area / area.sum())
    s, t = random.random((2, PLACES))
    s, t = np.where(s + t > 1, 1 - s, s), np.where(s + t > 1, 1 - t, t)
    points = a[chosen] + s[:, None] * (b - a)[chosen] + t[:, None] * (c - a)[chosen]
    # Corners, where a formula often has its largest value, as well.
    points = np.concatenate([points, corners.reshape(-1, 3)])
    unit = -normal / np.maximum(area, 1e-300)[:, None]
    return points.T, np.concatenate([unit[chosen], np.repeat(unit, 3, axis=0)]).T


def distance_to_faces(part: Part, names: Sequence[str]) -> Field | None:
    """Unsigned distance to regions, points ``(3, ...)`` mm to ``(...)`` mm; None without any."""
    if not names:
        return None
    return region_distance(np.concatenate([part.regions[name].corners for name in names]))
