"""Points on, and the distance to, a level set of a function of period 1."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from gradedesign.arrays import Field, FloatArray, IntArray
from gradedesign.errors import PluginError
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.fields.periodic_spline import periodic_spline


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

    Examples
    --------
    >>> slab = periodic_distance_to_level_set(lambda u: np.cos(2 * np.pi * u[0]), resolution=16)
    >>> round(float(slab(np.array([0.35, 0.1, 0.2]))), 2)
    -0.1
    """
    surface = level_set_points(function, level=level, resolution=resolution)
    nodes = np.stack(np.meshgrid(*[np.arange(resolution) / resolution] * 3, indexing="ij"))
    flat = nodes.reshape(3, -1)
    near = _nearest(surface, flat)
    for _ in range(2):
        near = _polished(function, level, flat, near)
    distance = np.linalg.norm(flat - near, axis=0)
    signed = np.where(function(flat) < level, -distance, distance)
    return periodic_spline(signed.reshape(nodes.shape[1:]))


def level_set_points(
    function: Field, *, level: float = 0.0, resolution: int = 64, newton_steps: int = 4
) -> FloatArray:
    """Points on a level set of a function of period 1, about one per grid edge that crosses it.

    Parameters
    ----------
    function : callable
        Points ``(3, ...)`` in cell units to ``(...)``.
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

    Examples
    --------
    >>> points = level_set_points(lambda u: np.cos(2 * np.pi * u[0]), resolution=8)
    >>> sorted(set((points[0] % 1).round(6).tolist()))
    [0.25, 0.75]
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
    batches: list[FloatArray] = []
    for d in range(3):
        after = np.roll(value, -1, axis=d)
        crosses = (value < 0) != (after < 0)
        start = nodes[:, crosses]
        start[d] += value[crosses] / (value[crosses] - after[crosses]) / resolution
        batches.append(start)
    points = np.concatenate(batches, axis=1)
    if points.shape[1] == 0:
        raise PluginError(
            f"the function crosses level {level:g} nowhere: its values lie between "
            f"{value.min() + level:g} and {value.max() + level:g}"
        )
    for _ in range(newton_steps):
        points = _on_level(function, level, points)
    return points


def _nearest(surface: FloatArray, points: FloatArray) -> FloatArray:
    """Nearest periodic image of surface samples to points of the unit cell, ``(3, n)``."""
    shifts = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1)
    # A tree over the 27 copies answers 2.5 times faster than a periodic tree.
    copies = (np.mod(surface, 1.0)[:, :, None] + shifts[:, None, :]).reshape(3, -1)
    tree = cKDTree(copies.T, balanced_tree=False, compact_nodes=False)
    index: IntArray = tree.query(points.T, workers=-1)[1]
    return copies[:, index]


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
