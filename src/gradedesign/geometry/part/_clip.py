"""Cutting triangles by an axis-aligned box."""

from __future__ import annotations

import numpy as np

from gradedesign.arrays import FloatArray, IntArray


def clip_to_box(
    corners: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Keep the parts of triangles that lie in a box, exactly.

    Sutherland and Hodgman (1974), "Reentrant polygon clipping": cut by one side of the box after
    the other; what is left of a triangle is convex and is fanned into triangles. Returns
    ``pieces (k, 3, 3)``, mm: oriented as the triangles they come from; ``source (k,)``: the
    triangle each piece comes from.

    ``corners (m, 3 corners, 3 coordinates)``, mm. ``lower (3,)``, ``upper (3,)``, mm.
    """
    lowest, highest = corners.min(axis=1), corners.max(axis=1)
    apart = ((highest < lower) | (lowest > upper)).any(axis=1)
    inside = ((lowest >= lower) & (highest <= upper)).all(axis=1)
    pieces = [corners[inside]]
    source = [np.flatnonzero(inside)]
    for k in np.flatnonzero(~inside & ~apart).tolist():
        polygon = corners[k]
        for axis in range(3):
            polygon = _cut(polygon, polygon[:, axis] - lower[axis])
            polygon = _cut(polygon, upper[axis] - polygon[:, axis])
        fan = [
            np.stack([polygon[0], polygon[i], polygon[i + 1]]) for i in range(1, len(polygon) - 1)
        ]
        if fan:
            pieces.append(np.stack(fan))
            source.append(np.full(len(fan), k))
    order = np.argsort(np.concatenate(source), kind="stable")
    return np.concatenate(pieces)[order], np.concatenate(source)[order].astype(np.int64)


def _cut(polygon: FloatArray, height: FloatArray) -> FloatArray:
    """Keep the part of a convex polygon ``(n, 3)`` where a linear function is not negative."""
    if len(polygon) == 0 or (height >= 0.0).all():
        return polygon
    corners = []
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        if height[k] >= 0.0:
            corners.append(polygon[k])
        if (height[k] >= 0.0) != (height[j] >= 0.0):
            share = height[k] / (height[k] - height[j])
            corners.append(polygon[k] + share * (polygon[j] - polygon[k]))
    return np.array(corners).reshape(-1, 3)
