"""The relative density that a map and a level really give, against the one asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape

_CHUNK = 1 << 18


@dataclass(frozen=True, slots=True, kw_only=True)
class SlabAchieved:
    """Mean densities of the part between two planes, mm along the axis of the slabs."""

    low: float
    high: float
    nominal: float
    effective: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DensityAchieved:
    """Mean nominal and effective densities, of the part and of its slabs.

    Attributes
    ----------
    nominal, effective : float
        Means over the part.
    points : int
        Sample points; the error of the effective mean is about half of ``1 / sqrt(points)``.
    slabs : tuple of SlabAchieved
        Along one axis; those without a point are left out.
    """

    nominal: float
    effective: float
    points: int
    slabs: tuple[SlabAchieved, ...]


def density_achieved(
    cell_map: Field,
    cell: Cell,
    density: Field | float,
    points: FloatArray,
    *,
    axis: int = 0,
    slabs: int = 1,
) -> DensityAchieved:
    """Share of points that lie in the solid ``g(u(x)) <= t(rho(x))``.

    Parameters
    ----------
    cell_map : callable
        Points ``(3, ...)`` mm to u ``(3, ...)``.
    cell : Cell
        Of the cell; its level follows the density at each point.
    density : callable or float
        Relative density asked for, points ``(3, ...)`` mm to ``(...)``.
    points : (3, n) array, mm
        Evenly inside the part, see :func:`gradedesign.geometry.maps.map_report.volume_points`: a
        regular grid beats with the cells.
    axis, slabs : int
        Coordinate axis that is cut into so many slabs of equal thickness.

    Returns
    -------
    DensityAchieved

    Raises
    ------
    LatticeError
        If there are no points or no slabs.
    DensityError
        If a density is outside the cell's window.

    Notes
    -----
    A map takes small volumes du to dx by one factor, so the share of solid in a cell is that of the
    calibration however the cell is stretched or sheared; what differs comes from the gradients of
    density and size within one cell and, in small parts, from cells cut by the surface.
    """
    x = np.asarray(points, dtype=np.float64).reshape(3, -1)
    if x.shape[1] == 0 or slabs < 1:
        raise LatticeError(
            f"density is measured at {x.shape[1]} points in {slabs} slabs; expected at least one "
            f"of each"
        )
    nominal, solid = np.zeros(x.shape[1]), np.zeros(x.shape[1])
    for low in range(0, x.shape[1], _CHUNK):
        part = slice(low, low + _CHUNK)
        at = x[:, part]
        nominal[part] = density(at) if callable(density) else density
        value = evaluate_shape(cell.family, cell.parameters, cell_map(at))
        solid[part] = value <= cell.level_of(nominal[part])
    first, last = float(x[axis].min()), float(x[axis].max())
    edges = np.linspace(first, last, slabs + 1)
    number = np.clip(np.searchsorted(edges, x[axis], side="right") - 1, 0, slabs - 1)
    held = np.bincount(number, minlength=slabs)
    wanted = np.bincount(number, nominal, minlength=slabs)
    held_solid = np.bincount(number, solid, minlength=slabs)
    return DensityAchieved(
        nominal=float(nominal.mean()),
        effective=float(solid.mean()),
        points=x.shape[1],
        slabs=tuple(
            SlabAchieved(
                low=float(edges[i]),
                high=float(edges[i + 1]),
                nominal=float(wanted[i] / held[i]),
                effective=float(held_solid[i] / held[i]),
            )
            for i in range(slabs)
            if held[i]
        ),
    )
