"""The thinnest wall or strut of a cell, in mm, and the density at which it can be printed.

What "thinnest" means:

- families whose shape is a true distance: ``2 t L``, exact (``t`` the level, ``L`` the cell size);
- two-sided sheets: twice the distance from the middle surface to the boundary, 1st percentile by
  area of the middle surface;
- struts about axes on which the shape is 0, its least value, and which connect (angular or unequal
  struts): the same from the axes;
- other one-sided networks: twice the smallest distance to the boundary along the strut that forms
  the last connection of the solid, from its saddle down to the minima of the shape function at
  its ends. It is zero at the percolation floor. In a random cell that strut is the last to hold a
  thousandth of the solid; beside it, at any density, some necks have only just formed.

All of them grow with the level because the points measured from stay where they are.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from gradedesign.arrays import Field, FloatArray
from gradedesign.common.system.cache import content_key, load_arrays, store_arrays
from gradedesign.errors import DensityError
from gradedesign.geometry.cell.calibration import LEAST_DENSITY
from gradedesign.geometry.cell.cell import Cell, cell_key
from gradedesign.geometry.cell.shape import evaluate_shape, grid_nodes
from gradedesign.geometry.fields.algebra import gradient
from gradedesign.geometry.fields.level_set import level_set_points

KIND = "cell-walls"

#: Share of a sheet's middle surface that may be thinner than the result. Chosen, not measured.
_THIN_SHARE = 0.01

#: Densities at which the wall is measured; a monotone cubic between. Chosen, not measured.
_STEPS = 13
#: Nodes along the edge of the cube in which surfaces are found.
_GRID = 48
#: The same where a period is several cells. Chosen, not measured.
_GRID_OF_LONG_PERIODS = 96

#: Edge of the cube about the neck of a cell of long period, cells; the strut is followed for one
#: cell to both sides. Chosen, not measured.
_NEAR = 3
#: Points of the middle surface at which a sheet's thickness is measured, of which 15 make up
#: `_THIN_SHARE`. Chosen, not measured.
_MIDDLE_POINTS = 1500

#: A point this near to a surface, in cell units, or to a valley, by its rise, lies on it.
_SETTLED = 1e-3


def wall_mm(
    cell: Cell,
    rho: FloatArray | float,
    cell_size: FloatArray | float,
) -> FloatArray:
    """Thinnest wall or strut, mm.

    Returns (...) array, mm: non-decreasing in ``rho``. Raises DensityError if a density is outside
    the cell's window.

    ``rho (...)``: relative density. ``cell_size (...)``, mm.
    """
    size = np.asarray(cell_size, dtype=np.float64)
    level = cell.level_of(rho)
    if cell.family.wall is not None:
        return np.asarray(cell.family.wall * size + np.zeros_like(level))
    if cell.family.distance:
        return np.asarray(2.0 * level * size)
    table = _wall_table(cell)
    return np.asarray(table(_progress(cell, rho)) * size)


def density_for_wall(
    cell: Cell,
    min_wall: float,
    cell_size: float,
) -> float:
    """Smallest relative density whose thinnest wall is at least ``min_wall`` mm.

    Raises DensityError if the wall is thinner even at the top of the cell's window.
    """
    window = cell.window
    density = np.linspace(*window, 2001)
    wall = wall_mm(cell, density, cell_size)
    enough = wall >= min_wall
    if not enough[-1]:
        raise DensityError(
            f"cell '{cell.name}' of {cell_size:g} mm has walls of at most {wall[-1]:.3g} mm, "
            f"reached at density {window[1]:.3f}, but {min_wall:g} mm was asked for; "
            f"use larger cells"
        )
    return float(density[int(np.argmax(enough))])


@lru_cache(maxsize=256)
def _wall_table(cell: Cell) -> PchipInterpolator:
    """Thinnest wall in cell units against `_progress`, non-decreasing, kept in the user's cache."""
    key = content_key(KIND, cell_key(cell))
    stored = load_arrays(KIND, key)
    wall = _measured_walls(cell) if stored is None else stored["wall"]
    if stored is None:
        store_arrays(KIND, key, wall=wall)
    return PchipInterpolator(np.linspace(0.0, 1.0, _STEPS), wall)


def _measured_walls(cell: Cell) -> FloatArray:
    """Thinnest wall in cell units at equal steps of `_progress`, non-decreasing, ``(_STEPS,)``."""
    family = cell.family
    view = _whole(cell)
    valley = family.sides == 2 or _has_axes(view, cell)
    if not valley:
        view = _near_neck(cell)
    core = _valley(view) if valley else _strut(view)
    top = -np.inf if valley else float(view.shape(core).max())
    progress = np.linspace(0.0, 1.0, _STEPS)
    a, b = cell.window
    wall = np.zeros(_STEPS)
    for i, level in enumerate(cell.level_of(a + (b - a) * progress**2)):
        # Voids too small for the grid, close to full density, add no wall to the last one measured.
        if top < level < view.seen:
            distance = _distance_to_level(view, float(level), core)
            wall[i] = 2.0 * view.edge * np.quantile(distance, _THIN_SHARE if valley else 0.0)
    return np.maximum.accumulate(wall)


class _View(NamedTuple):
    """A cube of cells in which walls are measured, scaled to the unit cube.

    ``shape`` takes points of the unit cube, ``edge`` is the cube's in cell units, ``neck`` the last
    connection of the solid in the unit cube, ``reach`` how far from it walls are measured,
    ``grid`` the number of nodes along the cube's edge, ``seen`` the greatest value at these nodes.
    """

    shape: Field
    edge: float
    neck: FloatArray
    reach: float
    grid: int
    seen: float


def _whole(cell: Cell) -> _View:
    """One period."""
    period = cell.family.period
    return _view(cell, np.zeros(3), period, _GRID if period == 1 else _GRID_OF_LONG_PERIODS)


def _near_neck(cell: Cell) -> _View:
    """One period, or a cube about the neck so large that its ends do not matter."""
    period = cell.family.period
    if period <= _NEAR:
        return _whole(cell)
    return _view(cell, np.array(cell.neck) - 0.5 * _NEAR, _NEAR, _GRID)


def _view(cell: Cell, corner: FloatArray, edge: float, grid: int) -> _View:
    """Cube of an edge from a corner on, both in cell units."""

    def shape(v: FloatArray) -> FloatArray:
        u = edge * v + corner.reshape(3, *[1] * (v.ndim - 1))
        return evaluate_shape(cell.family, cell.parameters, u)

    return _View(
        shape=shape,
        edge=float(edge),
        neck=(np.array(cell.neck) - corner)[:, None] / edge,
        reach=np.inf if edge == cell.family.period else 1.0 / edge,
        grid=grid,
        seen=float(shape(grid_nodes(grid, (0.5, 0.5, 0.5))).max()),
    )


def _progress(cell: Cell, rho: FloatArray | float) -> FloatArray:
    """Root of the share of the density window below a density, ``(...)``.

    The width of a neck grows with the root of the density above the lower end of the window.
    """
    a, b = cell.window
    return np.sqrt(np.clip((np.asarray(rho, dtype=np.float64) - a) / (b - a), 0.0, 1.0))


def _distance_to_level(view: _View, level: float, points: FloatArray) -> FloatArray:
    """Distance of points to a level set, both in the unit cube.

    The distance to the tangent planes of the nearest samples, so that the error is of second
    order in the spacing of the samples.
    """
    shape = view.shape
    surface = level_set_points(shape, level=level, resolution=view.grid, newton_steps=2)
    if np.isfinite(view.reach):
        # Where the cube ends, values jump; what lies on no surface of it must not be taken for one.
        inside = ((surface >= 0) & (surface <= 1)).all(axis=0)
        off = np.abs(shape(surface) - level)
        inside &= off <= _SETTLED * (view.seen - float(shape(view.neck)[0]))
        surface = surface[:, inside]
    surface = np.mod(surface, 1.0)
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


def _has_axes(view: _View, cell: Cell) -> bool:
    """Whether the places where a shape is 0, its least value, hold the cell together."""
    whole = cell.window[0] <= LEAST_DENSITY
    return whole and float(view.shape(grid_nodes(view.grid, (0.31, 0.57, 0.83))).min()) >= 0


def _valley(view: _View) -> FloatArray:
    """Points on the surface or the axes ``g = 0`` at the bottom of a shape, ``(3, k)``."""
    shape = view.shape
    points = grid_nodes(view.grid, (0.5, 0.5, 0.5)).reshape(3, -1)
    rise = float(shape(points).max())
    for _ in range(6):
        slope = gradient(shape, points, 1e-6)
        square = np.maximum((slope**2).sum(axis=0), 1e-12)
        value = shape(points)
        step = slope * (value / square)
        near = np.linalg.norm(step, axis=0) < 1.0 / view.grid
        points, value, step = points[:, near], value[near], step[:, near]
        points = points - step
    # Steps end on ridges, where differences cancel, too.
    points = points[:, shape(points) <= _SETTLED * rise]
    # Grid nodes within a step of the valley cover it evenly; a fixed stride thins them out.
    stride = max(points.shape[1] // _MIDDLE_POINTS, 1)
    return points[:, ::stride]


def _strut(view: _View) -> FloatArray:
    """Centre line of the last strut to connect, ``(3, k)``: two descents from its saddle."""
    shape = view.shape
    saddle = _saddle(view)
    along = np.linalg.eigh(_hessian(shape, saddle))[1][:, :1]
    step = 0.5 / view.grid
    line = [saddle]
    for sign in (-1.0, 1.0):
        point = saddle + sign * step * along
        value = float(shape(point)[0])
        for _ in range(2 * view.grid):
            slope = gradient(shape, point)
            following = point - slope * (step / max(float(np.linalg.norm(slope)), 1e-12))
            lower = float(shape(following)[0])
            if lower >= value or np.linalg.norm(following - saddle) > view.reach:
                break
            line.append(point)
            point, value = following, lower
    points = np.concatenate(line, axis=1)
    # Beside a kink of the shape, the first steps may lead over it.
    return points[:, shape(points) <= shape(saddle)]


def _saddle(view: _View) -> FloatArray:
    """Stationary point of the shape near the neck, ``(3, 1)``."""
    shape, start = view.shape, view.neck
    point = start
    for _ in range(8):
        slope = gradient(shape, point)
        point = point - np.linalg.lstsq(_hessian(shape, point), slope, rcond=1e-6)[0]
    # A shape with kinks has no smooth saddle: then the grid's answer stands.
    return point if float(np.linalg.norm(point - start)) < 3.0 / view.grid else start


def _hessian(shape: Field, point: FloatArray, step: float = 1e-4) -> FloatArray:
    """Second derivatives at one point ``(3, 1)`` by central differences, ``(3, 3)``."""
    rows = [
        (gradient(shape, point + d, step) - gradient(shape, point - d, step))[:, 0] / (2 * step)
        for d in step * np.eye(3)[:, :, None]
    ]
    return 0.5 * (np.stack(rows) + np.stack(rows).T)
