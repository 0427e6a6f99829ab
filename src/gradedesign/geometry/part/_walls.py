"""Cylindrical and conical walls found by the corners of facets, where slivers hide the normals.

The corners of a triangulated hole lie on its cylinder, however they are joined; a sliver between
them may face anywhere. So a cylinder is fitted around a facet, and every facet that hangs together
with it and has its corners on it belongs to it. Cones are found in the same way.
Above 300 lines: both kinds of wall share every step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.common.system.progress import report_step
from gradedesign.geometry.part._clusters import facet_patch
from gradedesign.geometry.part._curved_faces import FIT_SHARE
from gradedesign.geometry.part._face_fits import (
    Cylinder,
    Patch,
    angular_span,
    cone_through,
    cylinder_through,
    without_order,
)
from gradedesign.geometry.part._facet_sheet import FacetSheet, connected_facets, from_seeds
from gradedesign.geometry.part._wall_kernels import wall_facets

#: Corners lie on a cylinder within this share of its radius, within rounding, or within
#: so many times their median distance from it, which of corners anywhere between chord and circle
#: is a quarter of the chord error.
_ON_WALL = 3e-4
#: Four would be the whole chord error. Chosen, not measured.
_SCATTER = 3.0
#: A facet spans no more than this around the axis: holes of 12 facets are the coarsest.
_WIDEST = np.radians(31.0)
#: The sine by which a facet must face the axis or away from it: the flat end of a hole does not.
#: Chosen, not measured.
_FACING = 0.02
#: Facets of a cone face as it does within the first of these angles; within this share of the
#: angle to its axis where that is less, since the flat end of a flat cone faces much as it does.
_CONE_FACING, _CONE_SHARE = np.radians(20.0), 0.6
#: Share of the facets around a seed that must lie on a first fit. Chosen, not measured.
_INLIERS = 0.7
#: A wall goes this far around its axis, degrees, with so many facets. Chosen, not measured.
_SPAN, _LEAST_FACETS = 45.0, 8
#: A wall is fitted again until it stays, mostly three times; so often at most. Chosen, not
#: measured.
_MOST_FITS = 12
#: One whose corners lie off by the chord error of facets goes around half at least: less of a cone
#: lies as close to a cylinder along its side.
_LOOSE_SPAN = 170.0
#: Part of its rim across which the surface may go on smoothly: more, and it is a band of a sphere
#: or a torus. Chosen, not measured.
_OPEN_RIM = 0.3
#: A wall of more rows of facets than this is a cylinder though its rim is rounded: on a sphere or a
#: torus the corners of a second row lie off by four times the chord error of the first.
_ROWS = 3.0
#: A surface goes on smoothly along the axis where the neighbours tilt by these angles. Chosen, not
#: measured.
_TILTED = np.radians([1.0, 35.0])
#: A facet that faces along the axis is no sliver of the wall, cosine. Chosen, not measured.
_UPRIGHT = 0.9999


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wall:
    """Facets ``(k,)`` of a cylindrical or conical face."""

    facets: IntArray
    cylinder: Cylinder


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """A cylinder, or a cone, of this radius at a point of its axis and this rise along it."""

    axis: FloatArray
    centre: FloatArray
    radius: float
    rise: float

    @property
    def half_angle(self) -> float:
        return float(np.arctan(self.rise))

    def radii(self, points: FloatArray) -> FloatArray:
        """Radius ``(...)`` beside points ``(..., 3)``, mm; not above 0 beyond an apex."""
        return np.asarray(self.radius + self.rise * ((points - self.centre) @ self.axis))

    def off(self, points: FloatArray) -> FloatArray:
        """Distance ``(...)`` of points ``(..., 3)``, mm."""
        distance = _radial(points, self.axis, self.centre)[1]
        return np.asarray(np.abs(distance - self.radii(points)) * np.cos(self.half_angle))


#: Fit of facets to begin with, tapered or not.
_Fitting = Callable[[Patch], _Fit | None]


def find_walls(sheet: FacetSheet, cylindrical: BoolArray) -> list[tuple[str, Wall]]:
    """Walls that faces found by their normals miss or cut to pieces, and cones.

    Returns list of (kind, Wall): kind ``cylinder`` or ``cone``; without those that are one of the
    faces already.

    ``cylindrical``, (m,) bool array: facets of faces that are known as cylinders.
    """
    report_step("cylinders and cones of the part's surface")
    free = ~sheet.flat & ~cylindrical
    # The first walls may take pieces of what was known.
    walls = _found(sheet, free, np.zeros_like(free), _cylinder_of)
    taken = sheet.flat | cylindrical | _of_walls(walls, free)
    cones = _found(sheet, ~taken, taken, _cone_of)
    taken |= _of_walls(cones, free)
    if cones:  # beside them, those of few facets that a cone goes on from
        walls += _found(sheet, ~taken, taken, _cylinder_of)
    return [*(("cylinder", wall) for wall in walls), *(("cone", wall) for wall in cones)]


def _of_walls(walls: list[Wall], like: BoolArray) -> BoolArray:
    """Facets ``(m,)`` of walls."""
    mask = np.zeros_like(like)
    for wall in walls:
        mask[wall.facets] = True
    return mask


def _found(sheet: FacetSheet, free: BoolArray, taken: BoolArray, fit: _Fitting) -> list[Wall]:
    """Walls of one kind, from seeds that are free, without facets that are taken."""

    def find(near: IntArray) -> Wall | None:
        wall = _wall(sheet, near, taken, fit)
        return None if wall is None else _with_slivers(sheet, wall, ~(sheet.flat | taken))

    walls = from_seeds(sheet, free, taken, find)
    owner = np.full(len(free), -1)
    for number, wall in enumerate(walls):
        owner[wall.facets] = number
    # A later wall may have grown over an earlier one, of which slivers would be left.
    return [
        wall
        for number, wall in enumerate(walls)
        if 2 * np.count_nonzero(owner[wall.facets] == number) > len(wall.facets)
    ]


def _cylinder_of(patch: Patch) -> _Fit | None:
    found = cylinder_through(patch.points, patch.normals, patch.areas)
    if len(patch.points) < 6 or found is None:
        return None
    axis, centre, radius = found
    return _Fit(axis=axis, centre=centre, radius=radius, rise=0.0)


def _cone_of(patch: Patch) -> _Fit | None:
    found = cone_through(patch)
    if found is None:
        return None
    axis, centre, radius, rise = found
    return _Fit(axis=axis, centre=centre, radius=radius, rise=rise)


def _wall(sheet: FacetSheet, near: IntArray, taken: BoolArray, fit: _Fitting) -> Wall | None:
    """Wall that most facets around a seed belong to."""
    grown = _grown(sheet, near, _INLIERS, taken, fit)
    for _ in range(_MOST_FITS):
        if grown is None:
            return None
        facets, cylinder = grown
        grown = _grown(sheet, facets, 0.95, taken, fit)
        if grown is not None and len(grown[0]) == len(facets):
            break
    if grown is None:
        return None
    facets, cylinder = grown
    clusters = sheet.clusters
    loose = cylinder.deviation > max(clusters.noise, _ON_WALL * cylinder.radius)
    span = _span(sheet, facets, cylinder)
    if len(facets) < _LEAST_FACETS or span < (_LOOSE_SPAN if loose else _SPAN):
        return None
    corners = clusters.surface.vertices[np.unique(clusters.surface.faces[facets])]
    if loose and not without_order(corners, cylinder):
        return None
    if _goes_on(sheet, facets, cylinder, taken):
        return None
    return Wall(facets=facets, cylinder=cylinder)


def _grown(
    sheet: FacetSheet, facets: IntArray, share: float, taken: BoolArray, fitting: _Fitting
) -> tuple[IntArray, Cylinder] | None:
    """Extend facets by connected ones that lie on the wall through most of them."""
    patch = facet_patch(sheet.clusters, facets)
    fit = fitting(patch)
    if fit is None:
        return None
    own = fit.off(sheet.corners[facets]).max(axis=1)
    tolerance = _tolerance(sheet, facets, fit, fit.off(patch.points))
    if np.count_nonzero(own <= tolerance) < share * len(facets):
        return None
    facing = _FACING
    if fit.rise != 0.0:
        facing = np.cos(min(_CONE_FACING, _CONE_SHARE * (0.5 * np.pi - fit.half_angle)))
    result, sense = wall_facets(
        *(sheet.starts, sheet.beside, sheet.corners),
        *(sheet.clusters.facet_normals, sheet.clusters.facet_areas, taken, facets),
        np.array([*fit.axis, *fit.centre, fit.radius, fit.rise]),
        np.array([tolerance, np.cos(_WIDEST), facing, share * len(facets)]),
    )
    if not result.size:
        return None
    result.sort()
    corners = sheet.corners[result].reshape(-1, 3)
    along = (corners - fit.centre) @ fit.axis
    halfway = 0.5 * float(along.min() + along.max())
    return result, Cylinder(
        axis=fit.axis,
        point=fit.centre + halfway * fit.axis,
        radius=fit.radius + halfway * fit.rise,
        deviation=float(fit.off(corners).max()),
        concave=sense < 0.0,
        rise=fit.rise,
    )


def _tolerance(sheet: FacetSheet, facets: IntArray, fit: _Fit, off: FloatArray) -> float:
    """Largest distance from a wall, mm, at which a corner counts as on it.

    Corners of a remeshed part lie on the facets that it had before, so within their chord error.
    """
    outward, distance = _radial(sheet.corners[facets], fit.axis, fit.centre)
    unit = outward / np.maximum(distance, 1e-300)[..., None]
    cosine = np.median((unit * np.roll(unit, 1, axis=1)).sum(axis=2).min(axis=1))
    # A cone is as round as where its facets lie.
    radius = fit.radius if fit.rise == 0.0 else float(np.median(distance))
    flattened = radius * np.cos(fit.half_angle)
    chord_error = flattened * (1.0 - np.sqrt(0.5 * (1.0 + np.clip(cosine, 0.0, 1.0))))
    scattered = max(_SCATTER * float(np.median(off)), chord_error)
    return max(sheet.clusters.noise, _ON_WALL * radius, min(scattered, FIT_SHARE * radius))


def _with_slivers(sheet: FacetSheet, wall: Wall, allowed: BoolArray) -> Wall:
    """Add facets beside a wall whose corners lie on it, whatever their normals."""
    cylinder = wall.cylinder
    off = _fit_of(cylinder).off(sheet.corners)
    on = off.max(axis=1) <= _ON_WALL * cylinder.radius
    on &= allowed & (np.abs(sheet.clusters.facet_normals @ cylinder.axis) < _UPRIGHT)
    on[wall.facets] = True
    return Wall(facets=connected_facets(sheet, on, wall.facets), cylinder=cylinder)


def _fit_of(wall: Cylinder) -> _Fit:
    return _Fit(axis=wall.axis, centre=wall.point, radius=wall.radius, rise=wall.rise)


def _radial(
    points: FloatArray, axis: FloatArray, centre: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Vectors ``(..., 3)`` square to the axis, and their lengths."""
    offset = points - centre
    outward = offset - (offset @ axis)[..., None] * axis
    return outward, np.linalg.norm(outward, axis=-1)


def _span(sheet: FacetSheet, facets: IntArray, cylinder: Cylinder) -> float:
    """Degrees around the axis that facets cover."""
    return angular_span(sheet.corners[facets].reshape(-1, 3), cylinder)


def _goes_on(sheet: FacetSheet, facets: IntArray, cylinder: Cylinder, taken: BoolArray) -> bool:
    """Whether the surface beyond much of the rim goes on smoothly along the axis, as a sphere's.

    Facets that are taken belong to another face, so that the wall ends there.
    """
    inside = np.zeros(len(sheet.corners), dtype=bool)
    inside[facets] = True
    rim = inside[sheet.pairs].sum(axis=1) == 1
    pairs = sheet.pairs[rim]
    beyond = np.where(inside[pairs[:, 0]], pairs[:, 1], pairs[:, 0])
    slivers = _fit_of(cylinder).off(sheet.corners[beyond]).max(axis=1) <= (
        _ON_WALL * cylinder.radius
    )
    beyond, lengths = beyond[~slivers], sheet.lengths[rim][~slivers]
    half_angle = np.arctan(cylinder.rise)
    own = half_angle if cylinder.concave else -half_angle
    leaning = np.arcsin(np.clip(sheet.clusters.facet_normals[beyond] @ cylinder.axis, -1.0, 1.0))
    tilt = np.abs(leaning - own)
    smooth = (tilt > _TILTED[0]) & (tilt < _TILTED[1]) & ~taken[beyond]
    if smooth.any():
        length = float(np.ptp(sheet.corners[facets].reshape(-1, 3) @ cylinder.axis))
        row = float(np.median(np.ptp(sheet.corners[beyond[smooth]] @ cylinder.axis, axis=1)))
        if length > _ROWS * row:
            return False
    return bool(lengths[smooth].sum() > _OPEN_RIM * lengths.sum())
