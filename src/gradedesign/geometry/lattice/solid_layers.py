"""Fields of the solids of a part, exact in a band or everywhere, and their union with the cells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.banded_distance import banded_distance
from gradedesign.geometry.lattice.component import Distances, SolidLayer
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.lattice.rims import without_rims

#: Coarse grid of the banded distances, in bands. Chosen, not measured.
_COARSE = 4.0


def solid_layers(
    domain: DesignDomain, band: float | None = None
) -> tuple[Field, tuple[SolidLayer, ...]]:
    """Distance of the part, and of every solid in it, negative inside.

    Parameters
    ----------
    band : float, optional, mm
        Reach within which distances are exact, as are those that joints need; further away bounds
        from a coarse grid take their place. ``None``: exact everywhere.

    Raises
    ------
    LatticeError
        If the band is not positive.
    """
    if band is None:
        near = Distances(part=domain.distance, reach=np.inf, banded=lambda distance, *_: distance)
        return near.part, tuple(solid.layer(near) for solid in domain.solids)
    if not band > 0:
        raise LatticeError(f"band is {band:g} mm, expected a positive reach")
    reach = band if domain.join is None else max(band, domain.join.reach)

    def banded(distance: Field, inner: float, outer: float) -> Field:
        lower, upper = domain.lower - reach, domain.upper + reach
        return banded_distance(
            distance, lower, upper, spacing=_COARSE * reach, inner=inner, outer=outer
        )

    deepest = max((component.part_depth for component in domain.components), default=0.0)
    part = banded(domain.distance, reach + deepest, band)
    near = Distances(part=part, reach=reach, banded=banded)
    return part, tuple(solid.layer(near) for solid in domain.solids)


def united(
    domain: DesignDomain,
    layers: tuple[SolidLayer, ...],
    cell: Field,
    exact: Field,
    size: float,
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Union of the cells with the components of a domain, less rims and cuts, about mm.

    Parameters
    ----------
    layers : tuple of SolidLayer
        Of that domain.
    cell : callable
        Field of the infinite lattice, negative inside.
    exact : callable
        The same in double precision, of which gradients are taken.
    size : float, mm
        Of a cell.

    Returns
    -------
    callable
        Points ``(3, ...)`` mm and the part's distance there, to values ``(...)``.
    """
    on_cells, join, cuts = domain.on_cells, domain.join, domain.cuts

    def union(points: FloatArray, distance: FloatArray) -> FloatArray:
        value = whole(points, distance)
        if domain.least_rim:
            value = without_thin_rims(points, distance, value)
        for cut in cuts:
            value = np.maximum(value, -cut.distance(points))
        return value

    def without_thin_rims(
        points: FloatArray, distance: FloatArray, value: FloatArray
    ) -> FloatArray:
        reach = domain.least_rim + domain.overhang
        near = (np.asarray(distance) > -reach) & (value < 0.0)
        if near.any():
            value[near] = without_rims(
                value[near],
                points[:, near],
                whole,
                domain.distance,
                overhang=domain.overhang,
                wall=domain.least_rim,
            )
        return value

    def whole(points: FloatArray, distance: FloatArray) -> FloatArray:
        values = [layer(points, distance) for layer in layers]
        cells = np.asarray(cell(points), dtype=np.float64)
        flat = points.reshape(3, -1)
        for component in on_cells:
            more = component.over(cells.ravel(), flat, distance.ravel(), (cell, size))
            cells = more.reshape(cells.shape)
        if join is None or not values:
            return np.asarray(np.minimum.reduce([cells, *values]))
        solids = [(v.ravel(), _field(f)) for v, f in zip(values, layers, strict=True)]
        return join.joined(flat, (cells.ravel(), exact), solids).reshape(cells.shape)

    return union


def _field(layer: SolidLayer) -> Field:
    return lambda points: layer(points, None)
