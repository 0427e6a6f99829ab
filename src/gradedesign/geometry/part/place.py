"""Distances to volumes and faces that a case states, and random points on faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import CaseError
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.part.place_schema import CylinderVolume, PlaceSpec
from gradedesign.geometry.part.regions_schema import direction_vector
from gradedesign.geometry.part.signed_distance import region_distance, surface_distance
from gradedesign.geometry.triangles.surface_mesh import corner_points


def place_distance(part: Part, place: PlaceSpec) -> Field:
    """Exact signed distance to the volume of a place, mm, negative inside.

    Returns callable: points ``(3, ...)`` mm to distances ``(...)`` mm. Raises CaseError if the
    place states no volume.
    """
    if place.box is not None:
        lower, upper = np.array(place.box.lower), np.array(place.box.upper)
        return lambda points: _box_distance(points, lower, upper)
    if place.cylinder is not None:
        start, axis, length = _axis(place.cylinder)
        radius = 0.5 * place.cylinder.diameter
        return lambda points: _cylinder_distance(points, start, axis, radius, length)
    if place.body is not None:
        return surface_distance(part.bodies[place.body])
    raise CaseError("the place states no volume; expected box, cylinder or body")


def place_box(part: Part, place: PlaceSpec) -> tuple[FloatArray, FloatArray]:
    """Box around a place within that of the part, its corners ``(3,)`` mm; empty where apart."""
    points = part.surface.vertices
    if place.box is not None:
        points = np.array([place.box.lower, place.box.upper])
    elif place.cylinder is not None and place.cylinder.ends is not None:
        start, axis, length = _axis(place.cylinder)
        reach = 0.5 * place.cylinder.diameter * np.sqrt(np.maximum(1.0 - axis**2, 0.0))
        ends = np.stack([start, start + length * axis])
        points = np.concatenate([ends - reach, ends + reach])
    elif place.body is not None:
        body = part.bodies[place.body]
        points = body.vertices[np.unique(body.faces)]
    lower, upper = part.surface.vertices.min(axis=0), part.surface.vertices.max(axis=0)
    return np.maximum(points.min(axis=0), lower), np.minimum(points.max(axis=0), upper)


def _axis(spec: CylinderVolume) -> tuple[FloatArray, FloatArray, float]:
    """A point of a cylinder's axis, its unit vector, and its length from there, mm."""
    if spec.ends is None:
        return np.array(spec.point), np.array(direction_vector(spec.axis or "+z")), np.inf
    first, second = (np.array(end) for end in spec.ends)
    length = float(np.linalg.norm(second - first))
    return first, (second - first) / length, length


def _cylinder_distance(
    points: FloatArray, start: FloatArray, axis: FloatArray, radius: float, length: float
) -> FloatArray:
    """Signed distance to a cylinder, mm; one of infinite length goes both ways."""
    apart = points - start.reshape(3, *(1,) * (points.ndim - 1))
    along = np.tensordot(axis, apart, axes=1)
    across = np.sqrt(np.maximum((apart**2).sum(axis=0) - along**2, 0.0)) - radius
    if not np.isfinite(length):
        return np.asarray(across)
    return _outside(np.stack([across, np.abs(along - 0.5 * length) - 0.5 * length]))


def _box_distance(points: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Signed distance to a box, mm."""
    shape = (3, *(1,) * (points.ndim - 1))
    middle, half = (0.5 * (lower + upper)).reshape(shape), (0.5 * (upper - lower)).reshape(shape)
    return _outside(np.abs(points - middle) - half)


def _outside(beyond: FloatArray) -> FloatArray:
    """Distance to where all of ``(n, ...)`` distances beyond faces at right angles are below 0."""
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=0)
    return np.asarray(outside + np.minimum(beyond.max(axis=0), 0.0))


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
