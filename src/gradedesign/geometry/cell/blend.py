"""Two cells on one scale, and the density of every weighted mean of them.

Two shape functions differ in meaning and size, so they are brought to a common scale first:

- *rank*: the density at which a point becomes solid, from 0 to 1, the same for every cell;
- *distance*: the distance from the surface of a stated density, to first order.

Their weighted mean is not distributed as either, so it is turned back into a rank: for a table of
weights the mean is sampled over a period and its quantiles kept. The result is again the density at
which a point becomes solid, whatever the weight.

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

from gradedesign.arrays import Field, FloatArray, lock
from gradedesign.errors import blaming
from gradedesign.geometry.cell.cell import Cell
from gradedesign.geometry.cell.shape import evaluate_shape, spread_points
from gradedesign.geometry.fields.algebra import gradient

log = logging.getLogger(__name__)

Scale = Literal["rank", "distance"]
Shift = tuple[float, float, float]

#: Weights for which the mean is tabulated, and densities of each table. Chosen, not measured.
_WEIGHTS, _TABLE = 17, 1001
#: Points of a period, whose values in order give the level of every density. Chosen, not measured.
_SAMPLES = 48**3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Blend:
    """Weighted means of two cells, ordered by density."""

    #: Values of either cell on the common scale, from coordinates ``(3, n)`` of the first.
    ends: tuple[Field, Field]
    sheets: bool  #: Whether both are sheets whose sides are told, so that the mean is a sheet too.
    #: ``(k, m)``. The mean at k weights and m densities, both evenly spread from 0 to 1;
    #: non-decreasing along m.
    values: FloatArray

    def __post_init__(self) -> None:
        lock(self, values=(None, None))

    def rank(self, u: FloatArray, weight: FloatArray) -> FloatArray:
        """Density at which points ``(3, n)`` become solid; weights ``(n,)`` of the second cell."""
        mean = _mean(self.ends[0](u), self.ends[1](u), weight, self.sheets)
        density = np.linspace(0.0, 1.0, self.values.shape[1])
        place = weight * (len(self.values) - 1)
        below = np.minimum(place.astype(np.int64), len(self.values) - 2)
        share = place - below
        result = np.zeros(len(mean))
        for n in np.unique(below):
            at = below == n
            low = np.interp(mean[at], self.values[n], density)
            high = np.interp(mean[at], self.values[n + 1], density)
            result[at] = low + share[at] * (high - low)
        return result


@lru_cache(maxsize=256)
def blend_of(first: Cell, second: Cell, scale: Scale, shift: Shift, reference: float) -> Blend:
    """Sample the mean of two cells, the second moved by ``shift`` cells, for every weight.

    ``reference`` is the density of the surfaces from which *distance* counts. The same arguments
    give the same object.
    """
    sheets = scale == "rank" and None not in (first.family.signed, second.family.signed)

    def scaled(cell: Cell) -> Field:
        if scale == "distance":
            level, slope = cell.level_of(reference), _slope(cell, reference)
            return lambda u: (evaluate_shape(cell.family, cell.parameters, u) - level) / slope
        return (lambda u: rank(cell, u) * _side(cell, u)) if sheets else (lambda u: rank(cell, u))

    start, unmoved = scaled(first), scaled(second)

    def end(u: FloatArray) -> FloatArray:
        return unmoved(moved(u, shift))

    u = lcm(first.family.period, second.family.period) * spread_points(_SAMPLES)
    sampled = start(u), end(u)
    position = np.clip(np.linspace(0.0, 1.0, _TABLE) * _SAMPLES - 0.5, 0, _SAMPLES - 1)
    values = np.zeros((_WEIGHTS, _TABLE))
    for n, weight in enumerate(np.linspace(0.0, 1.0, _WEIGHTS)):
        mean = np.sort(_mean(*sampled, weight, sheets))
        values[n] = np.interp(position, np.arange(_SAMPLES), mean)
    log.info("mixes of %s and %s by %s", first.name, second.name, scale)
    return Blend(ends=(start, end), sheets=sheets, values=values)


def moved(u: FloatArray, shift: Shift) -> FloatArray:
    """Coordinates ``(3, n)`` in a cell that is moved by a shift, cells."""
    return np.asarray(u - np.asarray(shift, dtype=u.dtype)[:, None])


def rank(cell: Cell, u: FloatArray) -> FloatArray:
    """Density at which points ``(3, n)`` of one cell become solid, ``(n,)``."""
    return cell.density_of(evaluate_shape(cell.family, cell.parameters, u))


def _mean(
    start: FloatArray, end: FloatArray, weight: FloatArray | float, sheets: bool
) -> FloatArray:
    mean = np.asarray((1 - weight) * start + weight * end)
    return np.abs(mean) if sheets else mean


def _side(cell: Cell, u: FloatArray) -> FloatArray:
    """-1 and 1 on the two sides of the middle surface of a sheet."""
    signed = cell.family.signed
    if signed is None:
        raise ValueError(f"cell '{cell.name}' does not tell the sides of a middle surface")
    with blaming(f"cell '{cell.name}'"):
        return np.sign(signed(u, **cell.parameters))


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
