"""Fields of the solids of a part, exact in a band or everywhere, and their union with the cells."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from gradedesign.arrays import Field, FloatArray
from gradedesign.errors import LatticeError
from gradedesign.geometry.lattice.banded_distance import banded_distance
from gradedesign.geometry.lattice.component import Distances, SolidLayer
from gradedesign.geometry.lattice.domain import DesignDomain

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

    Examples
    --------
    >>> from gradedesign.geometry.lattice.domain import DesignDomain
    >>> box = DesignDomain(
    ...     distance=lambda p: np.abs(p).max(axis=0) - 9, lower=[-9] * 3, upper=[9] * 3
    ... )
    >>> distance, layers = solid_layers(box)
    >>> float(distance(np.zeros(3))), layers
    (-9.0, ())
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

    Returns callable: points ``(3, ...)`` mm and the part's distance there, to values ``(...)``.

    - ``layers``: of that domain
    - ``cell``: field of the infinite lattice, negative inside
    - ``exact``: the same in double precision, of which gradients are taken
    - ``size``, mm: of a cell
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


#: Angles between a face of the part and the wall behind it, degrees: up to the first, rims are
#: trimmed to the full wall, beyond the second they stay as cut. A rim of 30 degrees is thinner than
#: a wall over 1.7 walls, one of 40 over 1.2. Between them the wall that is asked for falls to
#: nothing, so that a trim ends without a step. Chosen.
_FLAT, _STEEP = 30.0, 40.0
#: Samples through a wall, below a face; the surface is found between them linearly. Chosen, not
#: measured.
_SAMPLES = 8
#: Step of differences over the wall: forward ones, of distances and of the field about mm. Chosen,
#: not measured.
_STEP = 1e-3
#: Shift over the wall off the points where a normal of the part is taken: points of a grid may lie
#: on the bisector of two faces, where neither is the nearest. No two components are alike.
_ASIDE = np.array([[0.011], [-0.017], [0.023]])
#: Least gradient, where a field has a kink. Chosen, not measured.
_LEAST = 1e-9
#: Faces that meet in a corner, and the cosine above which two of them are one. Chosen, not
#: measured.
_FACES, _SAME = 3, 0.9


def without_rims(
    values: FloatArray,
    points: FloatArray,
    body: Callable[[FloatArray, FloatArray], FloatArray],
    part: Field,
    *,
    overhang: float,
    wall: float,
) -> FloatArray:
    """Values of a body without the rims that are thinner than a wall below the part's faces.

    From the face straight into the part the solid goes on for some depth. Where that is less than
    the wall and the surface at its end is nearly parallel to the face, the solid is left out, and
    so is its continuation outside the part. The end of what stays is square to the face.

    Returns (n,) array: larger where a rim is left out; elsewhere unchanged where the body is not
    thin.

    - ``values (n,)``: of the body, negative inside, about mm
    - ``points (3, n)``, mm: not farther outside the part than the wall or the overhang
    - ``body``: points ``(3, k)`` and the part's distance there to values ``(k,)``
    - ``part``: distance of the part less the overhang, mm; exact
    - ``overhang``, mm: by which the part's faces were moved outward
    - ``wall``, mm
    """
    result = np.array(values, dtype=np.float64)
    inside = np.flatnonzero(values < 0.0)
    at = points[:, inside]
    # At an edge of the part the face beside the nearest one may cut the wall: it is the nearest a
    # wall's depth below that one. Two more faces meet in a corner.
    outward = np.zeros_like(at)
    seen = at + wall * _ASIDE
    for number in range(_FACES):
        distance = part(seen)
        near = -(distance + overhang) < wall
        inside, at, seen, outward = inside[near], at[:, near], seen[:, near], outward[:, near]
        distance = distance[near]
        if not len(inside):
            break
        normal = _unit_gradient(part, seen, _STEP * wall, distance)
        if number:
            other = (normal * outward).sum(axis=0) < _SAME
            inside, at, seen, normal = inside[other], at[:, other], seen[:, other], normal[:, other]
            distance = distance[other]
        outward, depth = normal, -(distance + overhang)
        # Of the point itself, whose distance from that face is one to a plane.
        depth += (outward * (seen - at)).sum(axis=0)
        lacks = _lacking(at, depth, outward, body, overhang, wall)
        result[inside] = np.maximum(result[inside], lacks)
        seen = at + wall * _ASIDE - (wall + np.maximum(-depth, 0.0)) * outward
    return result


def _lacking(
    at: FloatArray,
    depth: FloatArray,
    outward: FloatArray,
    body: Callable[[FloatArray, FloatArray], FloatArray],
    overhang: float,
    wall: float,
) -> FloatArray:
    """Wall that is asked for less the solid below a face, ``(n,)`` mm.

    Points ``(3, n)`` lie ``depth`` below a face with that outward normal. Minus infinity where a
    point belongs to another wall than the one that the face cuts.
    """
    foot = at + depth * outward

    def below(depths: FloatArray) -> FloatArray:
        return body(foot - depths * outward, -depths - overhang)

    lacks = np.full(at.shape[1], -np.inf)
    thickness = _solid_below(below, at.shape[1], wall)
    thin = (thickness < wall) & (depth <= thickness + _STEP * wall)
    if not thin.any():
        return lacks
    some, there = outward[:, thin], thickness[thin]
    end = foot[:, thin] - there * some

    def about_end(points: FloatArray) -> FloatArray:
        depths = there - ((points - end) * some).sum(axis=0)
        return body(points, -depths - overhang)

    cosine = -(_unit_gradient(about_end, end, _STEP * wall, about_end(end)) * some).sum(axis=0)
    flat, steep = np.cos(np.radians((_FLAT, _STEEP)))
    asked = wall * np.clip((cosine - steep) / (flat - steep), 0.0, 1.0)
    lacks[thin] = asked - there
    return lacks


def _solid_below(below: Callable[[FloatArray], FloatArray], count: int, wall: float) -> FloatArray:
    """Depth of the first surface below each of ``count`` feet, ``(count,)`` mm; the wall beyond it.

    0 where there is no solid at the foot.
    """
    depths = np.linspace(0.0, wall, _SAMPLES + 1)
    before = below(np.zeros(count))
    found = np.where(before < 0.0, wall, 0.0)
    open_ones = before < 0.0
    for low, high in pairwise(depths):
        after = below(np.full(count, high))
        leaves = open_ones & (after >= 0.0)
        found[leaves] = low + (high - low) * before[leaves] / (before[leaves] - after[leaves])
        open_ones &= ~leaves
        before = after
    return found


def _unit_gradient(field: Field, points: FloatArray, step: float, base: FloatArray) -> FloatArray:
    """Direction of the gradient by forward differences from values at the points, ``(3, n)``."""
    slope = np.stack([field(points + shift[:, None]) - base for shift in step * np.eye(3)])
    return slope / np.maximum(np.linalg.norm(slope, axis=0), _LEAST * step)
