"""Transition between two cell families, with exact density wherever they mix.

Two shape functions differ in meaning and size, so they are brought to a common scale first:

- *rank*: the density at which a point becomes solid, from 0 to 1, the same for every family;
- *distance*: the distance from the surface of a stated density, to first order.

Their weighted mean is not distributed as either, so it is turned back into a rank: for a table of
weights the blend is sampled over a cell and its quantiles kept. The result is again the density at
which a point becomes solid, whatever the weight, and where the weight is 0 or 1 it is the rank of
the one family alone, untouched.

Two sheets that tell their sides (`CellFamily.signed`) are mixed with the sign of the side, and the
absolute value of the mean is ranked: the mean of ``|f1|`` and ``|f2|`` is zero only where both
surfaces cross, so that the mix would fall apart into struts around these curves, while
``|mean of f1 and f2|`` is a sheet again.

References
----------
Raymont, thesis, Exeter 2011, section 4.4, eq. 4.9 (a mean of functions of one iso-value; its factor
1/2 halves that iso-value and is left out).
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import lru_cache
from math import lcm
from typing import Literal

import numpy as np

from gradedesign.arrays import FloatArray, locked
from gradedesign.errors import DensityError, blaming
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape, spread_points
from gradedesign.geometry.fields.algebra import gradient

log = logging.getLogger(__name__)

Scale = Literal["rank", "distance"]

#: Weights for which the blend is tabulated, and densities of each table. Chosen, not measured.
_WEIGHTS, _TABLE = 17, 1001
#: Points of a period, whose values in order give the level of every density. Chosen, not measured.
_SAMPLES = 48**3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellTransition:
    """A shape function with a weight as fourth cell coordinate, ordered by density.

    Attributes
    ----------
    first, second : Cell
        The families at weight 0 and 1.
    scale : {"rank", "distance"}
    shift : (float, float, float), cells
        By which the second family is moved.
    reference : float
        Density of the surfaces from which *distance* counts.
    reach : (float, float)
        For *distance*: mean ``|dg/du|`` of each family near that surface, per cell.
    window : (float, float)
        Densities that both families have.
    weights : (k,) array
        From 0 to 1.
    values : (k, m) array
        The blend at densities evenly spread from 0 to 1, non-decreasing along m.
    """

    first: Cell
    second: Cell
    scale: Scale
    shift: tuple[float, float, float]
    reference: float
    reach: tuple[float, float]
    window: tuple[float, float]
    weights: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", locked(self.weights, (None,), name="weights"))
        object.__setattr__(self, "values", locked(self.values, (None, None), name="values"))

    @property
    def sheets(self) -> bool:
        """Whether the mix of two sheets is a sheet."""
        return _both_sheets(self.first, self.second, self.scale)

    def shape(self, u: FloatArray) -> FloatArray:
        """Density at which points become solid, 0 to 1; the solid of density rho is ``<= rho``.

        Parameters
        ----------
        u : (4, ...) or (3, ...) array
            Cell coordinates, and the weight of the second family, 0 to 1; without it one half.

        Returns
        -------
        (...) array
        """
        flat = np.asarray(u).reshape(len(u), -1)
        weight = np.full(flat.shape[1], 0.5) if len(u) == 3 else np.asarray(flat[3], np.float64)
        result = np.zeros(flat.shape[1])
        start, end = weight <= 0, weight >= 1
        if start.any():
            result[start] = rank(self.first, flat[:3, start])
        if end.any():
            result[end] = rank(self.second, _moved(flat[:3, end], self.shift))
        mixed = ~(start | end)
        if mixed.any():
            w = weight[mixed]
            blend = self.blend(flat[:3, mixed], w)
            result[mixed] = self._rank_of_blend(blend, w)
        return result.reshape(u.shape[1:])

    def level_of(self, rho: FloatArray | float) -> FloatArray:
        """The level of a density is the density itself.

        Raises
        ------
        DensityError
            If a density is outside the window that both families share.
        """
        values = np.asarray(rho, dtype=np.float64)
        low, high = self.window
        if values.size and not (values.min() >= low - 1e-9 and values.max() <= high + 1e-9):
            raise DensityError(
                f"cells '{self.first.family.name}' and '{self.second.family.name}' both exist for "
                f"relative densities {low:.4f} to {high:.4f}, but {values.min():.4f} to "
                f"{values.max():.4f} was asked for"
            )
        return values

    def blend(self, u: FloatArray, weight: FloatArray) -> FloatArray:
        """Weighted mean of the two functions on their common scale, ``(n,)``."""
        start = _scaled(self.first, self.scale, self.reference, self.reach[0], u)
        moved = _moved(u, self.shift)
        two = _scaled(self.second, self.scale, self.reference, self.reach[1], moved)
        if not self.sheets:
            return np.asarray((1 - weight) * start + weight * two)
        start, two = start * _side(self.first, u), two * _side(self.second, moved)
        return np.abs((1 - weight) * start + weight * two)

    def _rank_of_blend(self, blend: FloatArray, weight: FloatArray) -> FloatArray:
        """Share of the cell that is solid at the level of each point."""
        density = np.linspace(0.0, 1.0, self.values.shape[1])
        place = weight * (len(self.weights) - 1)
        below = np.minimum(place.astype(np.int64), len(self.weights) - 2)
        share = place - below
        result = np.zeros(len(blend))
        for n in np.unique(below):
            at = below == n
            low = np.interp(blend[at], self.values[n], density)
            high = np.interp(blend[at], self.values[n + 1], density)
            result[at] = low + share[at] * (high - low)
        return result


def cell_transition(
    first: Cell,
    second: Cell,
    *,
    scale: Scale = "rank",
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
    reference: float | None = None,
) -> CellTransition:
    """Prepare the transition between two families.

    Parameters
    ----------
    first, second : Cell
    scale : {"rank", "distance"}
        Common scale on which they mix.
    shift : (float, float, float), cells
        By which the second family is moved. Struts that pass each other do not join; moved by
        half a cell they may, see :func:`gradedesign.geometry.cell.neck.joining_shift`.
    reference : float, optional
        Density of the surfaces from which *distance* counts; the middle of the common window
        without it.

    Returns
    -------
    CellTransition
        Kept for the process: the same arguments return the same object.

    Raises
    ------
    DensityError
        If there is no density that both families have.
    """
    low = max(first.window[0], second.window[0])
    high = min(first.window[1], second.window[1])
    if not low < high:
        raise DensityError(
            f"cells '{first.family.name}' ({first.window[0]:.4f} to {first.window[1]:.4f}) and "
            f"'{second.family.name}' ({second.window[0]:.4f} to {second.window[1]:.4f}) have no "
            f"relative density in common; choose other families"
        )
    middle = 0.5 * (low + high) if reference is None else reference
    return _tabulated(first, second, scale, shift, middle, (low, high))


@lru_cache(maxsize=256)
def _tabulated(
    first: Cell,
    second: Cell,
    scale: Scale,
    shift: tuple[float, float, float],
    reference: float,
    window: tuple[float, float],
) -> CellTransition:
    """Sample the blend for every weight."""
    period = lcm(first.family.period, second.family.period)
    u = period * spread_points(_SAMPLES)
    reach = (1.0, 1.0)
    if scale == "distance":
        reach = (_slope(first, reference), _slope(second, reference))
    moved = _moved(u, shift)
    start = _scaled(first, scale, reference, reach[0], u)
    two = _scaled(second, scale, reference, reach[1], moved)
    sheets = _both_sheets(first, second, scale)
    if sheets:
        start, two = start * _side(first, u), two * _side(second, moved)
    weights = np.linspace(0.0, 1.0, _WEIGHTS)
    position = np.clip(np.linspace(0.0, 1.0, _TABLE) * _SAMPLES - 0.5, 0, _SAMPLES - 1)
    values = np.zeros((_WEIGHTS, _TABLE))
    for n, weight in enumerate(weights):
        mean = (1 - weight) * start + weight * two
        samples = np.sort(np.abs(mean) if sheets else mean)
        values[n] = np.interp(position, np.arange(_SAMPLES), samples)
    log.info("transition %s to %s by %s", first.family.name, second.family.name, scale)
    return CellTransition(
        first=first,
        second=second,
        scale=scale,
        shift=shift,
        reference=reference,
        reach=reach,
        window=window,
        weights=weights,
        values=values,
    )


def _moved(u: FloatArray, shift: tuple[float, float, float]) -> FloatArray:
    """Cell coordinates ``(3, n)`` of a family that is moved."""
    return np.asarray(u - np.asarray(shift, dtype=u.dtype)[:, None])


def _both_sheets(first: Cell, second: Cell, scale: Scale) -> bool:
    """Whether both families know the sides of their middle surface and are mixed by rank."""
    signed = first.family.signed is not None and second.family.signed is not None
    return signed and scale == "rank"


def _side(cell: Cell, u: FloatArray) -> FloatArray:
    """-1 and 1 on the two sides of the middle surface of a sheet."""
    signed = cell.family.signed
    if signed is None:
        raise ValueError(f"cell '{cell.name}' does not tell the sides of a middle surface")
    with blaming(f"cell '{cell.name}'"):
        return np.sign(signed(u, **cell.parameters))


def rank(cell: Cell, u: FloatArray) -> FloatArray:
    """Density at which points ``(3, n)`` of one family become solid, ``(n,)``."""
    return cell.density_of(evaluate_shape(cell.family, cell.parameters, u))


def _scaled(cell: Cell, scale: Scale, reference: float, reach: float, u: FloatArray) -> FloatArray:
    """One family's function on the common scale."""
    if scale == "rank":
        return rank(cell, u)
    g = evaluate_shape(cell.family, cell.parameters, u)
    return np.asarray((g - cell.level_of(reference)) / reach)


def _slope(cell: Cell, density: float) -> float:
    """Median of ``|dg/du|`` over the eighth of the cell nearest to the surface of a density."""
    if cell.family.distance:
        return 1.0

    def shape(u: FloatArray) -> FloatArray:
        return evaluate_shape(cell.family, cell.parameters, u)

    u = cell.family.period * spread_points(20**3)
    away = np.abs(shape(u) - cell.level_of(density))
    near = u[:, np.argsort(away, kind="stable")[: u.shape[1] // 8]]
    return float(np.median(np.linalg.norm(gradient(shape, near, 1e-4), axis=0)))
