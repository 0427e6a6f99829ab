"""Level and relative density of a cell family, each from the other."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.system.progress import report_step
from gradedesign.errors import DensityError, PluginError
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.family import CellFamily
from gradedesign.geometry.cell.percolation import Percolation, percolation
from gradedesign.geometry.cell.shape import (
    complete_parameters,
    evaluate_shape,
    grid_nodes,
    require_period,
    spread_points,
)

log = logging.getLogger(__name__)

#: Below this density, and this close to full, no sampled level is trusted. Chosen, not measured.
LEAST_DENSITY = 0.01

#: Densities of the table of levels, one every 0.00025: linear between them. Chosen, not measured.
_TABLE = 4001

#: Points that are sampled at a time: half the time of all at once, whose arrays are new pages of
#: memory; 16,384 to 262,144 were measured alike.
_PIECE = 1 << 16

#: Nodes along one period on the coarse and the fine grid of the percolation. Chosen, not measured.
_NODES = (32, 64)
#: The same where a period is several cells, which more nodes have to resolve. Chosen, not measured.
_NODES_OF_LONG_PERIODS = (48, 96)


def calibrate(
    family: CellFamily, parameters: Mapping[str, float] | None = None, resolution: int = 128
) -> Cell:
    """Sample one period of a cell and tabulate the quantiles of its shape function.

    ``parameters``: override the family's defaults. ``resolution``: cube root of the number of
    samples. Returns Cell: kept for the process: the same arguments return the same object. Raises
    `CaseError` for an unknown parameter. Raises `PluginError` if the shape function breaks its
    contract, does not repeat after its period, or is constant over a part of the cell. Raises
    `DensityError` if at no density the solid is one connected piece with an open void.

    Notes
    -----
    The volume of ``g <= t`` is the distribution of ``g``, so ``t(rho)`` is its quantile. Evenly
    spread samples converge faster than random ones and, unlike those of a grid, for shapes with
    flat faces too.

    Examples
    --------
    >>> from gradedesign.geometry.cell.formula_cell import formula_cell
    >>> family = formula_cell("p", formula="cos(2*pi*x) + cos(2*pi*y) + cos(2*pi*z)")
    >>> cell = calibrate(family, resolution=32)
    >>> cell.name, cell is calibrate(family, resolution=32)
    ('p', True)
    """
    complete = complete_parameters(family, parameters)
    return _calibrate(family, tuple(complete.items()), resolution)


@lru_cache(maxsize=256)
def _calibrate(family: CellFamily, items: tuple[tuple[str, float], ...], resolution: int) -> Cell:
    """Calibrate with hashable arguments."""
    parameters = dict(items)
    report_step(f"calibrating cell {family.name}")
    require_period(family, parameters)
    samples = np.sort(_sampled(family, parameters, resolution**3))
    density = np.linspace(0.0, 1.0, _TABLE)
    rank = np.clip(density * samples.size - 0.5, 0, samples.size - 1)
    level = np.interp(rank, np.arange(samples.size), samples)
    necks, floor_level = _percolation(family, parameters)
    window = (
        max(_share(samples, floor_level), LEAST_DENSITY),
        min(_share(samples, necks.ceiling), 1 - LEAST_DENSITY),
    )
    _require_increasing(family, density, level, window)
    period = family.period
    x, y, z = necks.neck if period == 1 else necks.last_neck
    log.info("cell %s: densities %.4f to %.4f", family.name, *window)
    return Cell(
        family=family,
        parameters=parameters,
        density=density,
        level=level,
        window=window,
        neck=(period * x, period * y, period * z),
    )


def _sampled(family: CellFamily, parameters: Mapping[str, float], count: int) -> FloatArray:
    """Values of a shape function at evenly spread points."""
    pieces = []
    for first in range(0, count, _PIECE):
        points = family.period * spread_points(min(first + _PIECE, count), first)
        pieces.append(evaluate_shape(family, parameters, points))
    return np.concatenate(pieces)


def _share(samples: FloatArray, level: float) -> float:
    """Share of sorted samples below a level."""
    return float(np.searchsorted(samples, level)) / samples.size


def _percolation(family: CellFamily, parameters: Mapping[str, float]) -> tuple[Percolation, float]:
    """Percolation on the fine grid and the level of its floor, extrapolated where needed.

    Functions with a kink at the middle of the wall (sheets, distances) are never sampled at the
    kink, so on a grid a wall holds together only from about one grid step of thickness. That part
    of the floor is proportional to the step; two grids extrapolate it away.
    """
    coarse, fine = (
        percolation(
            evaluate_shape(family, parameters, family.period * grid_nodes(count)),
            open_void=family.open_void,
        )
        for count in (_NODES if family.period == 1 else _NODES_OF_LONG_PERIODS)
    )
    if fine is None or fine.floor >= fine.ceiling:
        void = " with an open void" if family.open_void else ""
        raise DensityError(
            f"cell '{family.name}' with {dict(parameters)} has no density at which one solid "
            f"connects to its neighbours in three directions{void}; it cannot be used"
        )
    if coarse is None or not (family.sides == 2 or family.distance):
        return fine, fine.floor
    return fine, 2 * fine.floor - coarse.floor


def _require_increasing(
    family: CellFamily, density: FloatArray, level: FloatArray, window: tuple[float, float]
) -> None:
    """Refuse a shape function that is constant over a part of the cell inside the window."""
    inside = (density >= window[0]) & (density <= window[1])
    flat = np.diff(level[inside]) <= 0
    if np.count_nonzero(inside) < 2 or flat.any():
        where = density[inside][:-1][flat]
        detail = f" near density {where[0]:.3f}" if where.size else ""
        raise PluginError(
            f"cell '{family.name}' has no strictly increasing level over its window "
            f"{window[0]:.4f} to {window[1]:.4f}{detail}: its shape function is constant over a "
            f"part of the cell; make it vary continuously"
        )
