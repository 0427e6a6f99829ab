"""The thinnest wall or strut of a cell, in mm, and the density at which it can be printed.

What "thinnest" means:

- families whose shape is a true distance: ``2 t L``, exact (``t`` the level, ``L`` the cell size);
- two-sided sheets: twice the distance from the middle surface to the boundary, 1st percentile by
  area of the middle surface;
- struts about axes on which the shape is 0, its least value, and which connect (angular or unequal
  struts): the same from the axes;
- other one-sided networks: twice the smallest distance to the boundary along the strut that forms
  the last connection of the solid, from its saddle down to the minima of the shape function at
  its ends. It is zero at the percolation floor.

All of them grow with the level because the points measured from stay where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from gradedesign.arrays import FloatArray
from gradedesign.cell.calibration import LEAST_DENSITY, Calibration, calibrate
from gradedesign.cell.family import CellFamily
from gradedesign.cell.shape import evaluate_shape, grid_nodes
from gradedesign.errors import DensityError
from gradedesign.fields import Field, gradient, level_set_points

#: Share of the middle surface of a sheet that may be thinner than the size returned.
THIN_SHARE = 0.01

_STEPS = 13
#: Nodes along one period on which surfaces are found.
_GRID = 48
_GRID_OF_LONG_PERIODS = 96
_MIDDLE_POINTS = 1500

#: A point this near to a surface, in cell units, or to a valley, by its rise, lies on it.
_SETTLED = 1e-3


def wall_mm(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    rho: FloatArray | float,
    cell_size: FloatArray | float,
) -> FloatArray:
    """Thinnest wall or strut, mm.

    Parameters
    ----------
    family : CellFamily
    parameters : mapping of str to float or None
        Override the family's defaults.
    rho : (...) array
        Relative density.
    cell_size : (...) array, mm

    Returns
    -------
    (...) array, mm
        Non-decreasing in ``rho``.

    Raises
    ------
    DensityError
        If a density is outside the cell's window.
    """
    calibration = calibrate(family, parameters)
    size = np.asarray(cell_size, dtype=np.float64)
    level = calibration.level_of(rho)
    if family.distance:
        return np.asarray(2.0 * level * size)
    table = _wall_table(calibration)
    return np.asarray(table(_progress(calibration, rho)) * size)


def density_for_wall(
    family: CellFamily,
    parameters: Mapping[str, float] | None,
    min_wall: float,
    cell_size: float,
) -> float:
    """Smallest relative density whose thinnest wall is at least ``min_wall`` mm.

    Raises
    ------
    DensityError
        If the wall is thinner even at the top of the cell's window.
    """
    window = calibrate(family, parameters).window
    density = np.linspace(*window, 2001)
    wall = wall_mm(family, parameters, density, cell_size)
    enough = wall >= min_wall
    if not enough[-1]:
        raise DensityError(
            f"cell '{family.name}' of {cell_size:g} mm has walls of at most {wall[-1]:.3g} mm, "
            f"reached at density {window[1]:.3f}, but {min_wall:g} mm was asked for; "
            f"use larger cells"
        )
    return float(density[int(np.argmax(enough))])


@lru_cache(maxsize=256)
def _wall_table(calibration: Calibration) -> PchipInterpolator:
    """Thinnest wall in cell units against `_progress`, non-decreasing.

    Measured in periods: there every shape has period 1.
    """
    family = calibration.family
    grid = _GRID if family.period == 1 else _GRID_OF_LONG_PERIODS
    progress = np.linspace(0.0, 1.0, _STEPS)
    a, b = calibration.window
    density = a + (b - a) * progress**2

    def shape(u: FloatArray) -> FloatArray:
        return evaluate_shape(family, calibration.parameters, family.period * u)

    valley = family.sides == 2 or _has_axes(shape, calibration, grid)
    core = _valley(shape, grid) if valley else _strut(shape, calibration, grid)
    top = -np.inf if valley else float(shape(core).max())
    # Voids too small for the grid, close to full density, add no wall to the last one measured.
    seen = float(shape(grid_nodes(grid, (0.5, 0.5, 0.5))).max())
    wall = np.zeros(_STEPS)
    for i, level in enumerate(calibration.level_of(density)):
        if top < level < seen:
            distance = _distance_to_level(shape, float(level), core, grid)
            wall[i] = 2.0 * family.period * np.quantile(distance, THIN_SHARE if valley else 0.0)
    return PchipInterpolator(progress, np.maximum.accumulate(wall))


def _progress(calibration: Calibration, rho: FloatArray | float) -> FloatArray:
    """Root of the way through the window: a neck grows with the root of what exceeds the floor."""
    a, b = calibration.window
    return np.sqrt(np.clip((np.asarray(rho, dtype=np.float64) - a) / (b - a), 0.0, 1.0))


def _distance_to_level(shape: Field, level: float, points: FloatArray, grid: int) -> FloatArray:
    """Distance of points to a level set of period 1.

    The distance to the tangent planes of the nearest samples, so that the error is of second
    order in the spacing of the samples.
    """
    surface = np.mod(level_set_points(shape, level=level, resolution=grid, newton_steps=2), 1.0)
    surface[surface >= 1.0] = 0.0
    distance, index = cKDTree(surface.T, boxsize=1.0).query(np.mod(points, 1.0).T)
    foot = surface[:, index]
    foot = foot + np.round(points - foot)
    apart = points - foot
    slope = gradient(shape, foot)
    length = np.maximum(np.linalg.norm(slope, axis=0), 1e-12)
    normal = slope / length
    along = (apart * normal).sum(axis=0)
    # Between sharp edges no plane is tangent; there the sample itself is the best there is.
    off = np.abs(shape(points - along * normal) - level)
    tangent = (np.abs(along) > 0.8 * distance) & (off <= _SETTLED * length)
    return np.where(tangent, np.abs(along), distance)


def _has_axes(shape: Field, calibration: Calibration, grid: int) -> bool:
    """Whether the places where a shape is 0, its least value, hold the cell together."""
    whole = calibration.window[0] <= LEAST_DENSITY
    return whole and float(shape(grid_nodes(grid, (0.31, 0.57, 0.83))).min()) >= 0


def _valley(shape: Field, grid: int) -> FloatArray:
    """Points on the surface or the axes ``g = 0`` at the bottom of a shape, ``(3, k)``."""
    points = grid_nodes(grid, (0.5, 0.5, 0.5)).reshape(3, -1)
    rise = float(shape(points).max())
    for _ in range(6):
        slope = gradient(shape, points, 1e-6)
        square = np.maximum((slope**2).sum(axis=0), 1e-12)
        value = shape(points)
        step = slope * (value / square)
        near = np.linalg.norm(step, axis=0) < 1.0 / grid
        points, value, step = points[:, near], value[near], step[:, near]
        points = points - step
    # Steps end on ridges, where differences cancel, too.
    points = points[:, shape(points) <= _SETTLED * rise]
    # Grid nodes within a step of the valley cover it evenly; a fixed stride thins them out.
    stride = max(points.shape[1] // _MIDDLE_POINTS, 1)
    return points[:, ::stride]


def _strut(shape: Field, calibration: Calibration, grid: int) -> FloatArray:
    """Centre line of the last strut to connect, ``(3, k)``: two descents from its saddle."""
    saddle = _saddle(shape, np.array(calibration.neck)[:, None] / calibration.family.period, grid)
    along = np.linalg.eigh(_hessian(shape, saddle))[1][:, :1]
    step = 0.5 / grid
    line = [saddle]
    for sign in (-1.0, 1.0):
        point = saddle + sign * step * along
        value = float(shape(point)[0])
        for _ in range(2 * grid):
            slope = gradient(shape, point)
            following = point - slope * (step / max(float(np.linalg.norm(slope)), 1e-12))
            lower = float(shape(following)[0])
            if lower >= value:
                break
            line.append(point)
            point, value = following, lower
    return np.concatenate(line, axis=1)


def _saddle(shape: Field, start: FloatArray, grid: int) -> FloatArray:
    """Stationary point of the shape near a point of the grid, ``(3, 1)``."""
    point = start
    for _ in range(8):
        slope = gradient(shape, point)
        point = point - np.linalg.lstsq(_hessian(shape, point), slope, rcond=1e-6)[0]
    # A shape with kinks has no smooth saddle: then the grid's answer stands.
    return point if float(np.linalg.norm(point - start)) < 3.0 / grid else start


def _hessian(shape: Field, point: FloatArray, step: float = 1e-4) -> FloatArray:
    """Second derivatives at one point ``(3, 1)`` by central differences, ``(3, 3)``."""
    rows = [
        (gradient(shape, point + d, step) - gradient(shape, point - d, step))[:, 0] / (2 * step)
        for d in step * np.eye(3)[:, :, None]
    ]
    return 0.5 * (np.stack(rows) + np.stack(rows).T)
