"""Cylindrical walls found by the corners of facets, where slivers hide them from the normals.

The corners of a triangulated hole lie on its cylinder, however they are joined; a sliver between
them may face anywhere. So a cylinder is fitted around a facet, and every facet that hangs together
with it and has its corners on it belongs to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from gradedesign.arrays import BoolArray, FloatArray, IntArray
from gradedesign.mesh.surface_mesh import corner_points
from gradedesign.part._clusters import Clusters
from gradedesign.part._curved_faces import FIT_SHARE
from gradedesign.part._edges import face_edges
from gradedesign.part._face_fits import (
    Cylinder,
    angular_span,
    cylinder_through,
    without_order,
)

#: Corners lie on a cylinder within this share of its radius, within rounding, or within
#: so many times their median distance from it, which of corners anywhere between chord and circle
#: is a quarter of the chord error.
_ON_WALL = 3e-4
_SCATTER = 3.0
#: A facet spans no more than this around the axis: holes of 12 facets are the coarsest.
_WIDEST = np.radians(31.0)
#: The sine by which a facet must face the axis or away from it: the flat end of a hole does not.
_FACING = 0.02
#: Facets around a seed that a first fit takes, and corners of them that must lie on it.
_AROUND, _INLIERS = 60, 0.7
#: Facets about a seed without a wall that are no seeds themselves: two rings. Of more, a seed
#: beside the rim would use up the wall's own.
_GIVEN_UP = 10
#: A wall goes this far around its axis, degrees, with so many facets.
_SPAN, _LEAST_FACETS = 45.0, 8
#: A wall is fitted again until it stays, mostly three times; so often at most.
_MOST_FITS = 12
#: One whose corners lie off by the chord error of facets goes around half at least: less of a cone
#: lies as close to a cylinder along its side.
_LOOSE_SPAN = 170.0
#: Part of its rim across which the surface may go on smoothly: more, and it is a band of a sphere
#: or a torus.
_OPEN_RIM = 0.3
#: A wall of more rows of facets than this is a cylinder though its rim is rounded: on a sphere or a
#: torus the corners of a second row lie off by four times the chord error of the first.
_ROWS = 3.0
#: A surface goes on smoothly along the axis where the neighbours tilt by these angles, sines.
_TILTED = np.sin(np.radians([1.0, 35.0]))
#: Neighbours across sharper edges than this are not looked at for a first fit, cosine.
_CORNER = np.cos(np.radians(60.0))
#: Flat faces above this share of the surface are no facets of a wall.
_FLAT_FACE = 0.02
#: A facet that faces along the axis is no sliver of the wall, cosine.
_UPRIGHT = 0.9999


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wall:
    """Facets ``(k,)`` of a cylindrical face."""

    facets: IntArray
    cylinder: Cylinder


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sheet:
    """The facets of a surface as the search takes them."""

    clusters: Clusters
    corners: FloatArray
    pairs: IntArray
    lengths: FloatArray
    around: tuple[IntArray, ...]


def find_walls(clusters: Clusters, label: IntArray, kinds: list[str]) -> list[Wall]:
    """Cylindrical walls that faces found by their normals miss or cut to pieces.

    Parameters
    ----------
    clusters : Clusters
    label : (m,) int array
        Face of every facet.
    kinds : list of str
        Kind of every face.

    Returns
    -------
    list of Wall
        Without those that are one of the faces already.
    """
    areas = np.bincount(label, clusters.facet_areas)
    plane = np.array([kind == "plane" for kind in kinds])
    whole = np.array([kind == "cylinder" for kind in kinds])
    flat = (plane & (areas > _FLAT_FACE * areas.sum()))[label]
    free = ~flat & ~whole[label]
    if not free.any():
        return []
    sheet = _sheet(clusters)
    seeds = np.flatnonzero(free)
    seeds = seeds[np.argsort(-clusters.facet_areas[seeds], kind="stable")]
    walls: list[Wall] = []
    for seed in seeds.tolist():
        if not free[seed]:
            continue
        near = _near(sheet, seed)
        wall = _wall(sheet, near)
        free[near[:_GIVEN_UP] if wall is None else wall.facets] = False
        if wall is not None:
            walls.append(_with_slivers(sheet, wall, ~flat))
            free[walls[-1].facets] = False
    return walls


def _sheet(clusters: Clusters) -> _Sheet:
    faces = clusters.surface.faces
    edges = face_edges(faces)
    ends = clusters.surface.vertices[edges.ends[edges.pair_edge]]
    normals = clusters.facet_normals
    first, second = edges.pairs.T
    smooth = (normals[first] * normals[second]).sum(axis=1) >= _CORNER
    both = np.concatenate([edges.pairs[smooth], edges.pairs[smooth][:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    limits = np.cumsum(np.bincount(both[:, 0], minlength=len(faces)))[:-1]
    return _Sheet(
        clusters=clusters,
        corners=corner_points(clusters.surface),
        pairs=edges.pairs,
        lengths=np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1),
        around=tuple(np.split(both[order, 1], limits)),
    )


def _near(sheet: _Sheet, seed: int) -> IntArray:
    """Facets around one, ring by ring, itself first."""
    near, front = [seed], [seed]
    while front and len(near) < _AROUND:
        front = sorted({j for k in front for j in sheet.around[k].tolist()}.difference(near))
        near += front
    return np.array(near)


def _wall(sheet: _Sheet, near: IntArray) -> Wall | None:
    """Wall that most facets around a seed belong to."""
    grown = _grown(sheet, near, _INLIERS)
    for _ in range(_MOST_FITS):
        if grown is None:
            return None
        facets, cylinder = grown
        grown = _grown(sheet, facets, 0.95)
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
    return None if _goes_on(sheet, facets, cylinder) else Wall(facets=facets, cylinder=cylinder)


def _grown(sheet: _Sheet, facets: IntArray, share: float) -> tuple[IntArray, Cylinder] | None:
    """Facets connected with some of these that lie on the cylinder through most of them."""
    clusters = sheet.clusters
    points = clusters.surface.vertices[np.unique(clusters.surface.faces[facets])]
    cylinder = cylinder_through(
        points, clusters.facet_normals[facets], clusters.facet_areas[facets]
    )
    if len(points) < 6 or cylinder is None:
        return None
    axis, centre, radius = cylinder
    own = np.abs(_radial(sheet.corners[facets], axis, centre)[1] - radius).max(axis=1)
    off = np.abs(_radial(points, axis, centre)[1] - radius)
    tolerance = _tolerance(sheet, facets, cylinder, off)
    if np.count_nonzero(own <= tolerance) < share * len(facets):
        return None
    on, sense = _on_wall(sheet, facets, axis, centre, radius, tolerance)
    if np.count_nonzero(on[facets]) < share * len(facets):
        return None
    result = _connected(sheet, on, facets)
    corners = sheet.corners[result].reshape(-1, 3)
    along = (corners - centre) @ axis
    off = np.abs(_radial(corners, axis, centre)[1] - radius)
    return result, Cylinder(
        axis=axis,
        point=centre + 0.5 * (along.min() + along.max()) * axis,
        radius=radius,
        deviation=float(off.max()),
        concave=sense < 0.0,
    )


def _tolerance(
    sheet: _Sheet,
    facets: IntArray,
    cylinder: tuple[FloatArray, FloatArray, float],
    off: FloatArray,
) -> float:
    """Distance from a cylinder, mm, within which a corner lies on it, from those of some corners.

    Corners of a remeshed part lie on the facets that it had before, so within their chord error.
    """
    axis, centre, radius = cylinder
    unit = _radial(sheet.corners[facets], axis, centre)[0] / radius
    cosine = np.median((unit * np.roll(unit, 1, axis=1)).sum(axis=2).min(axis=1))
    chord_error = radius * (1.0 - np.sqrt(0.5 * (1.0 + np.clip(cosine, 0.0, 1.0))))
    scattered = max(_SCATTER * float(np.median(off)), chord_error)
    return max(sheet.clusters.noise, _ON_WALL * radius, min(scattered, FIT_SHARE * radius))


def _with_slivers(sheet: _Sheet, wall: Wall, allowed: BoolArray) -> Wall:
    """Add the facets beside a wall that have their corners on it, wherever they face."""
    cylinder = wall.cylinder
    distance = _radial(sheet.corners, cylinder.axis, cylinder.point)[1]
    on = np.abs(distance - cylinder.radius).max(axis=1) <= _ON_WALL * cylinder.radius
    on &= allowed & (np.abs(sheet.clusters.facet_normals @ cylinder.axis) < _UPRIGHT)
    on[wall.facets] = True
    return Wall(facets=_connected(sheet, on, wall.facets), cylinder=cylinder)


def _connected(sheet: _Sheet, mask: BoolArray, facets: IntArray) -> IntArray:
    """Facets of a mask that hang together with most of some of them."""
    joined = sheet.pairs[mask[sheet.pairs].all(axis=1)]
    graph = coo_array(
        (np.ones(len(joined), dtype=np.int8), tuple(joined.T)), shape=(len(mask), len(mask))
    )
    part = connected_components(graph, directed=False)[1]
    return np.flatnonzero(mask & (part == np.bincount(part[facets[mask[facets]]]).argmax()))


def _radial(
    points: FloatArray, axis: FloatArray, centre: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Vectors ``(..., 3)`` square to the axis, and their lengths."""
    offset = points - centre
    outward = offset - (offset @ axis)[..., None] * axis
    return outward, np.linalg.norm(outward, axis=-1)


def _on_wall(
    sheet: _Sheet,
    facets: IntArray,
    axis: FloatArray,
    centre: FloatArray,
    radius: float,
    tolerance: float,
) -> tuple[BoolArray, float]:
    """Facets ``(m,)`` of a cylinder by their corners, and whether they face out (1) or in (-1)."""
    clusters = sheet.clusters
    outward, distance = _radial(clusters.surface.vertices, axis, centre)
    close = np.abs(distance - radius) <= tolerance
    on = np.asarray(close[clusters.surface.faces].all(axis=1))
    some = np.flatnonzero(on)
    unit = outward[clusters.surface.faces[some]] / radius
    # Of two corners the cosine of the angle between them around the axis.
    widest = (unit * np.roll(unit, 1, axis=1)).sum(axis=2).min(axis=1)
    middle = unit.mean(axis=1)
    facing = (middle * clusters.facet_normals[some]).sum(axis=1)
    own = np.isin(some, facets)
    sense = float(np.sign((facing * clusters.facet_areas[some])[own].sum()))
    on[some] = (widest >= np.cos(_WIDEST)) & (sense * facing > _FACING)
    return on, sense


def _span(sheet: _Sheet, facets: IntArray, cylinder: Cylinder) -> float:
    """Degrees around the axis that facets cover."""
    return angular_span(sheet.corners[facets].reshape(-1, 3), cylinder)


def _goes_on(sheet: _Sheet, facets: IntArray, cylinder: Cylinder) -> bool:
    """Whether the surface beyond much of the rim goes on smoothly along the axis, as a sphere's."""
    inside = np.zeros(len(sheet.corners), dtype=bool)
    inside[facets] = True
    rim = inside[sheet.pairs].sum(axis=1) == 1
    pairs = sheet.pairs[rim]
    beyond = np.where(inside[pairs[:, 0]], pairs[:, 1], pairs[:, 0])
    distance = _radial(sheet.corners[beyond], cylinder.axis, cylinder.point)[1]
    slivers = np.abs(distance - cylinder.radius).max(axis=1) <= _ON_WALL * cylinder.radius
    beyond, lengths = beyond[~slivers], sheet.lengths[rim][~slivers]
    tilt = np.abs(sheet.clusters.facet_normals[beyond] @ cylinder.axis)
    smooth = (tilt > _TILTED[0]) & (tilt < _TILTED[1])
    if smooth.any():
        length = float(np.ptp(sheet.corners[facets].reshape(-1, 3) @ cylinder.axis))
        row = float(np.median(np.ptp(sheet.corners[beyond[smooth]] @ cylinder.axis, axis=1)))
        if length > _ROWS * row:
            return False
    return bool(lengths[smooth].sum() > _OPEN_RIM * lengths.sum())
