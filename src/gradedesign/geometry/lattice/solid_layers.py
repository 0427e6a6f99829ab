"""Fields of the skins and passive regions of a part, exact in a band or everywhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.banded_distance import banded_distance
from gradedesign.geometry.lattice.domain import DesignDomain, PassiveRegion
from gradedesign.geometry.lattice.drain import drain_value
from gradedesign.geometry.lattice.joint import REACH, joined
from gradedesign.geometry.lattice.net_skin import net_value
from gradedesign.geometry.lattice.rims import without_rims
from gradedesign.geometry.lattice.skin import Skin, skin_value

#: Coarse grid of the banded distances, in bands. Chosen, not measured.
_COARSE = 4.0

#: Points ``(3, ...)`` mm and the part's distance there, where it is known, to the distance of a
#: solid layer, mm.
SolidLayer: TypeAlias = Callable[[FloatArray, FloatArray | None], FloatArray]


def solid_layers(
    domain: DesignDomain, band: float | None = None
) -> tuple[Field, tuple[SolidLayer, ...]]:
    """Distance of the part, and of every skin, passive region and filling, negative inside.

    Parameters
    ----------
    domain : DesignDomain
    band : float, optional, mm
        Reach within which distances are exact, as are those that joints need; further away bounds
        from a coarse grid take their place. ``None``: exact everywhere.

    Raises
    ------
    LatticeError
        If the band is not positive.
    """
    if band is None:
        part = domain.distance
        passive = (_passive(p, _less(p.distance, p.margin), part) for p in domain.passive)
        fillings = (_alone(filling.distance) for filling in domain.fillings)
        return part, (*(_skin(skin, part) for skin in domain.skins), *passive, *fillings)
    if not band > 0:
        raise LatticeError(f"band is {band:g} mm, expected a positive reach")
    reach = max(band, REACH * domain.joint_radius)

    def banded(distance: Field, inner: float, outer: float) -> Field:
        lower, upper = domain.lower - reach, domain.upper + reach
        return banded_distance(
            distance, lower, upper, spacing=_COARSE * reach, inner=inner, outer=outer
        )

    whole = [skin.thickness for skin in domain.skins if skin.faces is None]
    deepest = max([*whole, *(2 * net.thickness for net in domain.nets)], default=0.0)
    part = banded(domain.distance, reach + deepest, band)
    layers: list[SolidLayer] = []
    for skin in domain.skins:
        if skin.faces is None:
            layers.append(_skin(skin, part))
            continue
        # Bounds of the distance to the faces become bounds of that to the inner face.
        spread = skin.thickness - skin.least
        faces = banded(_less(skin.faces, skin.thickness), reach + spread, reach)
        layers.append(_skin(replace(skin, faces=_less(faces, -skin.thickness)), part))
    for region in domain.passive:
        # Beyond the part a volume counts less, see `_passive`: exact that much farther.
        beyond = reach if region.from_surface is None else 3 * reach + 2 * region.from_surface
        solid = banded(_less(region.distance, region.margin), reach, beyond)
        layers.append(_passive(region, solid, part))
    layers += [_alone(banded(filling.distance, reach, reach)) for filling in domain.fillings]
    return part, tuple(layers)


def united(
    domain: DesignDomain,
    layers: tuple[SolidLayer, ...],
    cell: Field,
    exact: Field,
    size: float,
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """Union of cells, skins and passive regions with joints, less rims and drain holes, about mm.

    Parameters
    ----------
    domain : DesignDomain
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
    radius = domain.joint_radius

    def union(points: FloatArray, distance: FloatArray) -> FloatArray:
        value = whole(points, distance)
        if domain.least_rim:
            value = without_thin_rims(points, distance, value)
        for drain in domain.drains:
            value = np.maximum(value, -drain_value(drain, points))
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
        for net in domain.nets:
            flat = points.reshape(3, -1)
            struts = net_value(net, flat, distance.ravel(), (cell, size))
            cells = np.minimum(cells, struts.reshape(cells.shape))
        if not radius or not values:
            return np.asarray(np.minimum.reduce([cells, *values]))
        functions = [_field(layer) for layer in layers]
        joint = joined(
            points.reshape(3, -1),
            (cells.ravel(), exact),
            [(v.ravel(), f) for v, f in zip(values, functions, strict=True)],
            radius,
        )
        return joint.reshape(cells.shape)

    return union


def _field(layer: SolidLayer) -> Field:
    return lambda points: layer(points, None)


def _alone(distance: Field) -> SolidLayer:
    return lambda points, _: distance(points)


def _skin(skin: Skin, part: Field) -> SolidLayer:
    if skin.faces is not None:
        return lambda points, _: skin_value(skin, points, None)
    return lambda points, distance: skin_value(
        skin, points, part(points) if distance is None else distance
    )


def _passive(region: PassiveRegion, solid: Field, part: Field) -> SolidLayer:
    """Layer of a passive region; that of a volume widens beyond the part's faces."""
    start = region.from_surface
    if start is None:
        return lambda points, _: solid(points)

    def volume(points: FloatArray, distance: FloatArray | None) -> FloatArray:
        to_part = part(points) if distance is None else distance
        # Where they are flush the distance to the volume is that beyond the face: less than twice.
        return np.asarray(solid(points) - 2.0 * np.maximum(to_part + start, 0.0))

    return volume


def _less(distance: Field, by: float) -> Field:
    return lambda points: distance(points) - by
