"""The algebra of implicit fields, and distances to level sets that cells need.

A field maps points ``(3, ...)`` in mm to values ``(...)``, negative inside. The operations take
fields and return fields. They keep the sign exactly; where they keep true distances, they say so.
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter
from scipy.spatial import cKDTree

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.errors import PluginError

__all__ = [
    "Field",
    "FloatArray",
    "blend_intersection",
    "blend_union",
    "complement",
    "difference",
    "gradient",
    "intersection",
    "level_set_points",
    "offset",
    "periodic_distance_to_level_set",
    "r_intersection",
    "r_union",
    "shell",
    "union",
]


def union(*fields: Field) -> Field:
    """Inside any: the minimum. A distance outside; inside a lower bound of one.

    Examples
    --------
    >>> left, right = (lambda p: p[0]), (lambda p: 2 - p[0])
    >>> float(union(left, right)(np.array([3.0, 0, 0])))
    -1.0
    """
    return _combined(np.minimum, fields)


def intersection(*fields: Field) -> Field:
    """Inside all: the maximum. A distance inside; outside a lower bound of one."""
    return _combined(np.maximum, fields)


def complement(field: Field) -> Field:
    """Inside becomes outside."""
    return lambda points: -field(points)


def difference(field: Field, *removed: Field) -> Field:
    """Inside the first, outside all others."""
    return intersection(field, *(complement(other) for other in removed))


def offset(field: Field, distance: float) -> Field:
    """Grow by ``distance`` mm, or shrink where negative; exact for true distances."""
    return lambda points: field(points) - distance


def shell(field: Field, thickness: float) -> Field:
    """Layer of ``thickness`` mm just inside the surface of a distance field.

    Raises
    ------
    ValueError
        If the thickness is not positive.
    """
    if not thickness > 0:
        raise ValueError(f"a shell of thickness {thickness:g} mm is empty; use a positive one")

    def evaluate(points: FloatArray) -> FloatArray:
        value = field(points)
        return np.maximum(value, -thickness - value)

    return evaluate


def blend_union(first: Field, second: Field, radius: float) -> Field:
    """Union with a concave fillet.

    The fillet of two true distances that meet at a right angle is an exact arc of ``radius``;
    wherever one of the fields is ``radius`` or more, the result is the plain minimum.

    Parameters
    ----------
    first, second : Field
    radius : float, mm

    Raises
    ------
    ValueError
        If the radius is negative.
    """
    if not radius >= 0:
        raise ValueError(f"a blend radius of {radius:g} mm is impossible; use 0 mm or more")

    def evaluate(points: FloatArray) -> FloatArray:
        a, b = first(points), second(points)
        reach = np.hypot(np.maximum(radius - a, 0.0), np.maximum(radius - b, 0.0))
        return np.maximum(radius, np.minimum(a, b)) - reach

    return evaluate


def blend_intersection(first: Field, second: Field, radius: float) -> Field:
    """Intersection with a convex rounding of ``radius`` mm; see `blend_union`."""
    return complement(blend_union(complement(first), complement(second), radius))


def r_union(first: Field, second: Field) -> Field:
    """Union by an R-function: smooth except where both fields vanish; no distance.

    References
    ----------
    Rvachev's system R0; Pasko et al., The Visual Computer 11 (1995) 429, sign turned.
    """

    def evaluate(points: FloatArray) -> FloatArray:
        a, b = first(points), second(points)
        return a + b - np.hypot(a, b)

    return evaluate


def r_intersection(first: Field, second: Field) -> Field:
    """Intersection by an R-function; see `r_union`."""
    return complement(r_union(complement(first), complement(second)))


def periodic_distance_to_level_set(
    function: Field, *, level: float = 0.0, resolution: int = 48
) -> Field:
    """Tabulate the signed distance to a level set of a function of period 1.

    The distance of every node of a periodic grid is exact to about 1e-6 away from kinks of the
    level set; cubic splines interpolate it, so the zero set keeps its place to about 1e-5 cell
    and the ridges, where two pieces of surface are equally near, are rounded over one grid step.

    Parameters
    ----------
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``, smooth near the level set, period 1.
    level : float
    resolution : int
        Grid steps per cell.

    Returns
    -------
    Field
        Points ``(3, ...)`` in cell units to the distance in cell units, negative where
        ``function < level``; a pure function of its argument.

    Raises
    ------
    PluginError
        If the function is not finite, or has no such level set.
    """
    surface = level_set_points(function, level=level, resolution=resolution)
    nodes = np.stack(np.meshgrid(*[np.arange(resolution) / resolution] * 3, indexing="ij"))
    flat = nodes.reshape(3, -1)
    near = _nearest(surface, flat)
    for _ in range(2):
        near = _polished(function, level, flat, near)
    distance = np.linalg.norm(flat - near, axis=0)
    signed = np.where(function(flat) < level, -distance, distance)
    table = spline_filter(signed.reshape(nodes.shape[1:]), order=3, mode="grid-wrap")
    table.flags.writeable = False

    def evaluate(u: FloatArray) -> FloatArray:
        points = np.asarray(u, dtype=np.float64)
        value = map_coordinates(
            table, resolution * points.reshape(3, -1), order=3, mode="grid-wrap", prefilter=False
        )
        return np.asarray(value, dtype=np.float64).reshape(points.shape[1:])

    return evaluate


def level_set_points(
    function: Field, *, level: float = 0.0, resolution: int = 64, newton_steps: int = 4
) -> FloatArray:
    """Points on a level set of a function of period 1, about one per grid edge that crosses it.

    Parameters
    ----------
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``.
    level : float
    resolution : int
        Grid steps per cell.
    newton_steps : int
        Projections along the gradient after linear interpolation.

    Returns
    -------
    (3, k) array, cell units

    Raises
    ------
    PluginError
        If the function is not finite, or crosses the level nowhere on the grid.
    """
    # Nodes off the symmetry planes, so that no family vanishes on whole planes of nodes.
    axis = (np.arange(resolution) + 0.5) / resolution
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
    value = np.asarray(function(nodes)) - level
    if value.shape != nodes.shape[1:] or not np.isfinite(value).all():
        raise PluginError(
            f"a level-set function returned shape {value.shape} with "
            f"{int(np.count_nonzero(~np.isfinite(value)))} values that are not finite for points "
            f"{nodes.shape}; expected finite values of shape {nodes.shape[1:]}"
        )
    found: list[FloatArray] = []
    for d in range(3):
        after = np.roll(value, -1, axis=d)
        crosses = (value < 0) != (after < 0)
        start = nodes[:, crosses]
        start[d] += value[crosses] / (value[crosses] - after[crosses]) / resolution
        found.append(start)
    points = np.concatenate(found, axis=1)
    if points.shape[1] == 0:
        raise PluginError(
            f"the function crosses level {level:g} nowhere: its values lie between "
            f"{value.min() + level:g} and {value.max() + level:g}"
        )
    for _ in range(newton_steps):
        points = _on_level(function, level, points)
    return points


def _combined(operation: np.ufunc, fields: tuple[Field, ...]) -> Field:
    """Fold fields with a binary operation."""
    if not fields:
        raise ValueError("combining no fields has no meaning; give at least one")
    return lambda points: reduce(operation, (field(points) for field in fields))


def _nearest(surface: FloatArray, points: FloatArray) -> FloatArray:
    """Nearest periodic image of surface samples to points of the unit cell, ``(3, n)``."""
    shifts = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1)
    # A tree over the 27 copies answers 2.5 times faster than a periodic tree.
    copies = (np.mod(surface, 1.0)[:, :, None] + shifts[:, None, :]).reshape(3, -1)
    tree = cKDTree(copies.T, balanced_tree=False, compact_nodes=False)
    index: IntArray = tree.query(points.T, workers=-1)[1]
    return copies[:, index]


def gradient(function: Field, points: FloatArray, step: float = 1e-5) -> FloatArray:
    """Gradient of a function of points ``(3, n)`` by central differences, ``(3, n)``."""
    shifts = step * np.eye(3)[:, :, None]
    return np.stack([function(points + s) - function(points - s) for s in shifts]) / (2 * step)


def _on_level(function: Field, level: float, points: FloatArray) -> FloatArray:
    """One Newton step towards the level along the gradient."""
    slope = gradient(function, points)
    square = np.maximum((slope**2).sum(axis=0), 1e-12)
    return points - slope * ((function(points) - level) / square)


def _polished(function: Field, level: float, query: FloatArray, near: FloatArray) -> FloatArray:
    """Slide surface points towards the foot of the perpendicular; keep what came nearer."""
    normal = gradient(function, near)
    normal /= np.maximum(np.linalg.norm(normal, axis=0), 1e-12)
    apart = query - near
    trial = near + apart - normal * (normal * apart).sum(axis=0)
    trial = _on_level(function, level, _on_level(function, level, trial))
    off = np.abs(function(trial) - level)
    better = ((query - trial) ** 2).sum(axis=0) < (apart**2).sum(axis=0)
    return np.where(better & (off < 1e-6), trial, near)
