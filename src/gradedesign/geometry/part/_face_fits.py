"""Fitting cylinders and cones to patches of a triangle surface.

Above 300 lines: cylinder and cone share their steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import FloatArray

#: Normals of a cylinder stand this square to its axis, sine of an angle. Chosen, not measured.
_SQUARE = np.sin(np.radians(2.0))
#: Facets of a cylinder face its axis within this angle, cosine; 30-degree facets do.
_RADIAL = np.cos(np.radians(16.0))
#: Facet normals must spread at least this far for an axis to be determined, sine of an angle.
#: Chosen, not measured.
_SPREAD = np.sin(np.radians(0.2))
#: Facets whose normals spread less than this are flat, as far as a cylinder goes. Chosen, not
#: measured.
_CURVED = np.sin(np.radians(3.0))
#: Corners this close to an axis, as a share of a face's size, lie on it; arcs that are no farther
#: apart, degrees, meet. Both are rounding.
_ON_AXIS, _NO_GAP = 1e-6, 1e-6
#: Corners of a cone this close to its axis, as a share of its radius, are its apex; chosen.
_APEX = 1e-2
#: Sines of the half angles of cones, 2 and 85 degrees: below, facets pass for those of a cylinder,
#: above for those of a plane.
_LEAST_TAPER, _MOST_TAPER = np.sin(np.radians([2.0, 85.0]))
#: Part of a wall's length that tells whether it is straight, and share of the variance of its
#: corners' distances that a bent or tapered wall explains; chosen, on the bores of the tests.
_INNER, _ORDER = 0.8, 0.6
#: Ways in which a wall may be bent or tapered: powers 0 to 2 along, each by three around the axis.
_MODES = 9
#: Corners that are this close to a circle, as a share of its radius, need no such test: half of the
#: chord error of 50 facets.
_ROUND = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patch:
    """Geometry of a set of facets."""

    points: FloatArray  #: ``(n, 3)``, mm. Vertices.
    centres: FloatArray  #: ``(m, 3)``, mm. Centroids of the facets.
    normals: FloatArray  #: ``(m, 3)``. Unit outward normals.
    areas: FloatArray  #: ``(m,)``, mm^2.


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cylinder:
    """A cylinder or a cone through the vertices of a patch."""

    #: ``(3,)``. Unit vector; its largest component is positive, or it points to where a cone is
    #: wide.
    axis: FloatArray
    point: FloatArray  #: ``(3,)``, mm. On the axis, halfway along the patch.
    radius: float  #: mm. At that point.
    deviation: float  #: mm. Largest distance of a vertex from the surface.
    concave: bool  #: True where the outward normals point to the axis: a hole.
    #: Of the radius along the axis: the tangent of a cone's half angle; 0 of a cylinder.
    rise: float = 0.0


def fit_cylinder(patch: Patch) -> Cylinder | None:
    """Fit the cylinder whose facets a patch may be.

    The axis is the direction in which the normals have least part; centre and radius are the
    least-squares circle (Kasa 1976) of the vertices seen along it.

    Returns
    -------
    Cylinder or None
        None if the facets do not lie around a common axis, all facing it or all facing away.
        How well the vertices fit is in ``deviation``.
    """
    if patch.areas.sum() <= 0.0 or len(patch.points) < 4:
        return None
    weight = patch.areas / patch.areas.sum()
    spread, directions = np.linalg.eigh((patch.normals * weight[:, None]).T @ patch.normals)
    axis = directions[:, 0] * np.sign(directions[np.argmax(np.abs(directions[:, 0])), 0])
    if spread[1] < _SPREAD**2 or np.abs(patch.normals @ axis).max() > _SQUARE:
        return None
    centre, radius = _circle(patch.points, axis)
    outward = patch.centres - centre
    outward = outward - np.outer(outward @ axis, axis)
    distance = np.linalg.norm(outward, axis=1)
    facing = (outward * patch.normals).sum(axis=1) / np.maximum(distance, 1e-300)
    around = np.abs(facing) >= _RADIAL
    if not around.all() or np.unique(np.sign(facing)).size > 1:
        return None
    along = (patch.points - centre) @ axis
    return Cylinder(
        axis=axis,
        point=centre + 0.5 * (along.min() + along.max()) * axis,
        radius=radius,
        deviation=float(off_cylinder(patch.points, axis, centre, radius).max()),
        concave=bool(facing[0] < 0),
    )


def off_cylinder(
    points: FloatArray, axis: FloatArray, centre: FloatArray, radius: float
) -> FloatArray:
    """Distance of points ``(n, 3)`` from a cylinder's wall, ``(n,)``, mm."""
    offset = points - centre
    return np.abs(np.linalg.norm(offset - np.outer(offset @ axis, axis), axis=1) - radius)


def cylinder_through(
    points: FloatArray, normals: FloatArray, areas: FloatArray
) -> tuple[FloatArray, FloatArray, float] | None:
    """Axis, a point on it and the radius of the cylinder that most corners of facets lie on.

    Facets that tilt along the axis lose their weight, then the corners that lie off: slivers
    between corners on a cylinder face anywhere, though their corners are right. Last comes the
    least-squares cylinder of what is left, by Gauss-Newton steps.

    Returns tuple or None: none where the facets are flat.

    ``points (n, 3)``, mm. ``normals (m, 3)``: unit normals of the facets. ``areas (m,)``, mm^2.
    """
    weight = areas / areas.sum()
    for _ in range(4):
        spread, directions = np.linalg.eigh((normals * weight[:, None]).T @ normals)
        if spread[1] < _CURVED**2 * spread[2]:
            return None
        axis = directions[:, 0]
        tilt = (normals @ axis) ** 2
        weight = areas / (1.0 + tilt / _SQUARE**2)
        weight /= weight.sum()
    centre, radius = _circle(points, axis)
    found = _least_squares(points, axis, centre, radius, 0.0)
    if found is None:
        return None
    axis, centre, radius, _ = found
    return axis * np.sign(axis[np.argmax(np.abs(axis))]), centre, radius


def cone_through(patch: Patch) -> tuple[FloatArray, FloatArray, float, float] | None:
    """Axis, a point on it, the radius there and its rise along the axis, of a cone.

    The normals of a cone make one angle with its axis: it is the direction in which they vary
    least. Centre and radius are linear in the squares of the corners' distances then; last comes
    the least-squares cone of the corners.

    Returns
    -------
    tuple or None
        The axis points to where the cone is wide: the rise is positive. None where the facets are
        flat, or of a cylinder.
    """
    if len(patch.points) < 7:
        return None
    weight = patch.areas / patch.areas.sum()
    for _ in range(4):
        mean = weight @ patch.normals
        varied = patch.normals - mean
        spread, directions = np.linalg.eigh((varied * weight[:, None]).T @ varied)
        if spread[1] < _SPREAD**2:
            return None
        axis = directions[:, 0]
        weight = patch.areas / (1.0 + (varied @ axis) ** 2 / _SQUARE**2)
        weight /= weight.sum()
    sine = abs(float(weight @ patch.normals @ axis))
    if not _LEAST_TAPER < sine < _MOST_TAPER:
        return None
    rise = sine / np.sqrt(1.0 - sine**2)
    across, up = _square_directions(axis)
    middle = patch.points.mean(axis=0)
    x, y, z = ((patch.points - middle) @ direction for direction in (across, up, axis))
    # (x - cx)^2 + (y - cy)^2 = (radius + rise z)^2
    system = np.stack([2.0 * x, 2.0 * y, 2.0 * rise * z, np.ones_like(x)], axis=1)
    cx, cy, radius, _ = np.linalg.lstsq(system, x**2 + y**2 - (rise * z) ** 2, rcond=1e-12)[0]
    if radius < 0.0:
        axis, radius = -axis, -radius
    centre = middle + cx * across + cy * up
    found = _least_squares(patch.points, axis, centre, float(radius), float(rise))
    if found is None or not _LEAST_TAPER < np.sin(np.arctan(found[3])) < _MOST_TAPER:
        return None
    return found


#: Change of a fit, by its radius, after which further steps change nothing: coordinates of an STL
#: file are rounded to 1e-7.
_SETTLED = 1e-10


def _least_squares(
    points: FloatArray, axis: FloatArray, centre: FloatArray, radius: float, rise: float
) -> tuple[FloatArray, FloatArray, float, float] | None:
    """Least-squares cone of points by Gauss-Newton steps; a cylinder where the rise is 0.

    Points that lie off are left out at every fourth step, half of them at most.
    """
    tapered = rise != 0.0
    # A ring of corners and an apex do not tell a shift from a turn: rounding must not.
    least = 1e-4 if tapered else 1e-9
    near_points, settled = points, False
    for step in range(12):
        if settled and step % 4 != 3:
            continue
        across, up = _square_directions(axis)
        offset = near_points - centre
        x, y, along = offset @ across, offset @ up, offset @ axis
        distance = np.maximum(np.hypot(x, y), 1e-300)
        off = distance - radius - rise * along
        # An apex lies in no direction, but without it a ring of corners is no cone.
        apex = tapered & (distance <= _APEX * radius)
        if step % 4 == 3:
            near = apex | (np.abs(off) <= 4.0 * np.median(np.abs(off)))
            if np.count_nonzero(near) >= max(6, len(points) // 2):
                settled &= bool(near.all())
                near_points = near_points[near]
                continue
        u, w = np.where(apex, 0.0, x / distance), np.where(apex, 0.0, y / distance)
        ones = np.ones_like(u)
        turned = (-along * u - rise * x, -along * w - rise * y)
        system = np.stack([-u, -w, *turned, -ones, *[-along] * tapered], axis=1)
        scale = np.array([1.0, 1.0, 1.0 / radius, 1.0 / radius, 1.0, *[1.0 / radius] * tapered])
        change = scale * np.linalg.lstsq(system * scale, -off, rcond=least)[0]
        centre = centre + change[0] * across + change[1] * up
        axis = axis + change[2] * across + change[3] * up
        axis, radius = axis / float(np.linalg.norm(axis)), float(radius + change[4])
        rise = float(rise + change[5]) if tapered else 0.0
        if not (np.isfinite(radius) and radius > 0.0 and np.isfinite(rise)):
            return None
        settled = bool((np.abs(change / scale) <= _SETTLED * radius).all())
    return axis, centre, radius, rise


def without_order(points: FloatArray, cylinder: Cylinder) -> bool:
    """Whether corners ``(n, 3)`` lie off a cylinder, or a cone, without order.

    On a piece of a cone, a sphere or a waist that was gathered within a tolerance the radius rises
    or bends along the axis by as much as that. The ends do not count: a rim may be rounded.
    """
    offset = points - cylinder.point
    along = offset @ cylinder.axis
    length = float(np.ptp(along))
    inner = np.abs(along) <= 0.5 * _INNER * length
    if np.count_nonzero(inner) <= _MODES:
        return False  # corners at the rims alone show no order and no lack of it
    across, up = _square_directions(cylinder.axis)
    x, y, z = offset[inner] @ across, offset[inner] @ up, along[inner] / length
    radius = np.hypot(x, y)
    off = radius - cylinder.rise * along[inner]
    off -= off.mean()
    if np.abs(off).max() <= _ROUND * cylinder.radius:
        return True
    around = (np.ones_like(z), x / radius, y / radius)
    modes = np.stack([z**power * mode for power in range(3) for mode in around], axis=1)
    left = off - modes @ np.linalg.lstsq(modes, off, rcond=1e-9)[0]
    free = 1.0 - _MODES / len(off)  # what modes leave of values without order
    return bool(left @ left > (1.0 - _ORDER) * free * (off @ off))


def angular_span(points: FloatArray, cylinder: Cylinder) -> float:
    """Degrees around the axis that vertices cover: 360 less the largest gap."""
    across, up = _square_directions(cylinder.axis)
    offset = points - cylinder.point
    angles = np.sort(np.degrees(np.arctan2(offset @ up, offset @ across)))
    gaps = np.append(np.diff(angles), angles[0] + 360.0 - angles[-1])
    return float(360.0 - gaps.max())


def covered_angle(corners: FloatArray, axis: FloatArray, point: FloatArray) -> float:
    """Degrees around an axis that triangles ``(k, 3, 3)`` cover, 360 where they close."""
    across, up = _square_directions(axis)
    offset = corners - point
    angle = np.degrees(np.arctan2(offset @ up, offset @ across))
    # Corners on the axis lie in all directions: they take that of another corner.
    apex = np.hypot(offset @ up, offset @ across) <= _ON_AXIS * np.abs(offset).max()
    angle = np.where(apex, np.nan, angle)
    first = np.where(np.isnan(angle[:, :1]), angle[:, 1:2], angle[:, :1])
    turn = np.mod(angle - first + 180.0, 360.0) - 180.0
    low = np.mod(first[:, 0] + np.nanmin(turn, axis=1), 360.0)
    width = np.nanmax(turn, axis=1) - np.nanmin(turn, axis=1)
    # Arcs from low on, those beyond 360 degrees once more from their start less a turn.
    starts = np.concatenate([low, low - 360.0])
    ends = np.minimum(starts + np.concatenate([width, width]), 360.0)
    order = np.argsort(starts)
    reach = np.maximum.accumulate(np.append(0.0, ends[order]))
    gaps = np.append(starts[order], 360.0) - reach
    return float(360.0 - np.maximum(gaps, 0.0)[gaps > _NO_GAP].sum())


def _circle(points: FloatArray, axis: FloatArray) -> tuple[FloatArray, float]:
    """Least-squares circle of points seen along an axis: centre ``(3,)`` and radius, mm."""
    across, up = _square_directions(axis)
    middle = points.mean(axis=0)
    x, y = (points - middle) @ across, (points - middle) @ up
    scale = max(float(np.abs([x, y]).max()), 1e-300)
    x, y = x / scale, y / scale
    system = np.stack([2 * x, 2 * y, np.ones_like(x)], axis=1)
    cx, cy, rest = np.linalg.lstsq(system, x**2 + y**2, rcond=None)[0]
    radius = float(np.sqrt(max(rest + cx**2 + cy**2, 0.0)))
    return middle + scale * (cx * across + cy * up), scale * radius


def _square_directions(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors square to an axis and to each other."""
    # By hand: fits ask for them at every step, and a general product takes most of their time.
    x, y, z = axis.tolist()
    least = int(np.argmin(np.abs(axis)))
    across = np.array([(0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)][least])
    across /= np.linalg.norm(across)
    u, v, w = across.tolist()
    return across, np.array([y * w - z * v, z * u - x * w, x * v - y * u])
