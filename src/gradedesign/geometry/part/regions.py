"""Regions: the named sets of smooth faces on which a part is held, loaded and measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gradedesign.arrays import BoolArray, FloatArray, IntArray, lock
from gradedesign.errors import CaseError
from gradedesign.geometry.part._clip import clip_to_box
from gradedesign.geometry.part._face_filters import (
    BOX_SHARE,
    FacedPart,
    Match,
    faced_part,
    matches,
)
from gradedesign.geometry.part._file_filter import marked_triangles
from gradedesign.geometry.part._nesting import facet_areas
from gradedesign.geometry.part._region_messages import check_assertions, listing, nothing_found
from gradedesign.geometry.part.bore import Bore, common_bore
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.regions_schema import BoxSpec, RegionSpec
from gradedesign.geometry.part.signed_distance import region_distance
from gradedesign.geometry.part.smooth_faces import SmoothFaces
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points

#: Distances that differ by this share of the part's diagonal differ by rounding only.
_EQUAL = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Region:
    """Selected triangles of a part's surface."""

    name: str
    triangles: IntArray  #: ``(k,)``. Triangle of the surface that each piece belongs to.
    #: ``(k, 3 corners, 3 coordinates)``, mm. The pieces: whole triangles, or what a clipping box
    #: leaves of them.
    corners: FloatArray
    area: float  #: mm^2.
    centroid: FloatArray  #: ``(3,)``, mm.
    faces: tuple[int, ...]  #: The smooth faces they belong to.
    #: mm. Length of its border that a clipping box cut: no edge of the part runs there.
    cut_length: float = 0.0
    bore: Bore | None = None  #: The bore that it is the wall of, or some of it.

    def __post_init__(self) -> None:
        lock(self, dtype=np.int64, triangles=(None,))
        lock(self, corners=(None, 3, 3), centroid=(3,))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Selection:
    """Faces of a region before they are cut, its triangles on them, and the boxes that cut them."""

    faces: BoolArray
    triangles: BoolArray
    clips: tuple[BoxSpec, ...] = ()


def select_regions(
    surface: SurfaceMesh,
    faces: SmoothFaces,
    specs: Mapping[str, RegionSpec],
    file_faces: FileFaces | None = None,
) -> dict[str, Region]:
    """Find the faces of every region.

    All keys of a region must hold; ``nearest`` then picks one of the faces left. Keys on faces,
    names and colours of the file take whole triangles, which may be some of a smooth face.

    Returns dict of str to Region: in the order of ``specs``. Raises CaseError if a region is empty,
    is the whole surface, breaks its ``count`` or ``area``, or refers to itself or to a region that
    does not exist.

    ``faces``: of that surface. ``file_faces``: faces of the file on that surface.
    """
    part = faced_part(surface, faces)
    done: dict[str, _Selection] = {}
    for name in specs:
        _resolve(part, specs, name, done, (), file_faces)
    return {name: _region(part, name, specs[name], done[name]) for name in specs}


def _resolve(
    part: FacedPart,
    specs: Mapping[str, RegionSpec],
    name: str,
    done: dict[str, _Selection],
    above: tuple[str, ...],
    file_faces: FileFaces | None,
) -> _Selection:
    """Select the faces of one region, after those of the regions it names."""
    if name in done:
        return done[name]
    if name in above:
        raise CaseError(f"region.{above[0]}: regions refer in a circle: {' -> '.join(above)}")
    if name not in specs:
        names = ", ".join(specs)
        raise CaseError(f"region.{above[-1]}: names the region {name!r}; there are {names}")
    spec = specs[name]
    named = {
        operand: _resolve(part, specs, operand, done, (*above, name), file_faces)
        for operand in spec.names
    }
    filters = [*matches(part, spec), *_combined(part, spec, named, name)]
    triangles = np.ones(len(part.faces.label), dtype=bool)
    if spec.face or spec.name or spec.color:
        triangles = marked_triangles(spec, file_faces, name)
        filters.append(_touched(part, triangles, "face, name and color of the file"))
    triangles &= _combined_triangles(spec, named, len(triangles))
    fits = np.asarray(np.all([match.fits for match in filters] or [_everything(part)], axis=0))
    miss = np.sum([match.miss for match in filters], axis=0) if filters else np.zeros(len(fits))
    if not fits.any():
        raise CaseError(nothing_found(part, name, filters, miss))
    if spec.nearest is not None:
        fits = nearest_face(part, fits, np.array(spec.nearest))
    clips = tuple(box for operand in spec.all for box in named[operand].clips)
    if len(spec.any) == 1:
        clips += named[spec.any[0]].clips
    if spec.clip and spec.box is not None:
        clips += (spec.box,)
    triangles &= fits[part.faces.label]
    if not triangles.any():
        raise CaseError(nothing_found(part, name, filters, miss))
    done[name] = _Selection(faces=fits, triangles=triangles, clips=clips)
    return done[name]


def _everything(part: FacedPart) -> BoolArray:
    return np.ones(len(part.corners), dtype=bool)


def _touched(part: FacedPart, triangles: BoolArray, key: str) -> Match:
    """Faces that hold some of these triangles, ``(m,)``."""
    fits = np.bincount(part.faces.label[triangles], minlength=len(part.corners)) > 0
    return Match(key=key, fits=fits, miss=np.where(fits, 0.0, 1.0))


def _combined_triangles(spec: RegionSpec, named: Mapping[str, _Selection], count: int) -> BoolArray:
    """Triangles ``(m,)`` that the regions leave which a region names."""
    result = np.ones(count, dtype=bool)
    for member in spec.all:
        result &= named[member].triangles
    if spec.any:
        result &= np.any([named[member].triangles for member in spec.any], axis=0)
    for member in spec.not_:
        result &= ~named[member].triangles
    return result


def _combined(
    part: FacedPart, spec: RegionSpec, named: Mapping[str, _Selection], name: str
) -> list[Match]:
    """Judge faces by the regions that a region names."""
    loose = spec.not_ if len(spec.any) < 2 else (*spec.any, *spec.not_)
    clipped = [member for member in loose if named[member].clips]
    if clipped:
        raise CaseError(
            f"region.{name}: {', '.join(clipped)} are cut by a box, and cut faces cannot be "
            "united or excluded; name such regions one by one where they are used"
        )
    result = []
    for word, members in (("any", spec.any), ("all", spec.all), ("not", spec.not_)):
        if members:
            taken = np.array([named[member].triangles for member in members])
            selected = taken.all(axis=0) if word == "all" else taken.any(axis=0)
            selected = np.asarray(~selected if word == "not" else selected)
            result.append(_touched(part, selected, f"{word} of {', '.join(members)}"))
    return result


def nearest_face(part: FacedPart, fits: BoolArray, point: FloatArray) -> BoolArray:
    """Keep the one face nearest to a point; the first of equals."""
    chosen = np.flatnonzero(fits)
    to_face = [float(region_distance(part.corners[k])(point[:, None])[0]) for k in chosen]
    equal = np.array(to_face) <= min(to_face) + _EQUAL * part.diagonal
    result = np.zeros(len(fits), dtype=bool)
    result[chosen[equal][0]] = True
    return result


def _region(part: FacedPart, name: str, spec: RegionSpec, selection: _Selection) -> Region:
    """Cut out the triangles of a region and check what the case asserts about it."""
    triangles = np.flatnonzero(selection.triangles)
    corners = corner_points(part.surface)[triangles]
    cuts = []
    for box in selection.clips:
        if len(corners) == 0:
            break
        lower, upper = _snapped(part, corners, box)
        whole = corners.reshape(-1, 3)
        # Planes that pass through the surface: those beyond it or flush with its end cut nothing.
        cuts += [(axis, at) for axis, at in enumerate(lower) if at > whole[:, axis].min()]
        cuts += [(axis, at) for axis, at in enumerate(upper) if at < whole[:, axis].max()]
        corners, source_triangle = clip_to_box(corners, lower, upper)
        triangles = triangles[source_triangle]
    corners, triangles = _without_edges(part, corners, triangles)
    used = np.unique(part.faces.label[triangles]).tolist()
    if not used:
        raise CaseError(
            f"region.{name}: the box cuts nothing out of the {selection.faces.sum()} faces that "
            f"fit otherwise:{listing(part, np.flatnonzero(selection.faces).tolist())}"
        )
    areas = facet_areas(corners)
    area = float(areas.sum())
    total = float(sum(face.area for face in part.faces.faces))
    if area > (1.0 - 1e-6) * total:
        raise CaseError(
            f"region.{name}: selects the whole surface, all {len(part.corners)} faces "
            f"({area:.4g} mm^2); a region must leave some of it free"
        )
    check_assertions(part, name, spec, used, area)
    return Region(
        name=name,
        triangles=triangles,
        corners=corners,
        area=area,
        centroid=areas @ corners.mean(axis=1) / area,
        faces=tuple(used),
        cut_length=_length_on(corners, cuts, BOX_SHARE * part.diagonal),
        bore=common_bore([part.faces.faces[k] for k in used]),
    )


def _length_on(corners: FloatArray, planes: list[tuple[int, float]], slack: float) -> float:
    """Length of the edges of triangles that lie on planes across an axis, mm."""
    ahead = np.roll(corners, -1, axis=1)
    length = np.linalg.norm(ahead - corners, axis=2)
    lies = np.zeros(length.shape, dtype=bool)
    for axis, at in planes:
        near = np.abs(corners[..., axis] - at) <= slack
        lies |= near & np.roll(near, -1, axis=1)
    return float(length[lies].sum())


def _snapped(part: FacedPart, corners: FloatArray, box: BoxSpec) -> tuple[FloatArray, FloatArray]:
    """Extend a box to corners just outside it, so that flush faces are selected whole."""
    points, slack = corners.reshape(-1, 3), BOX_SHARE * part.diagonal
    lower, upper = np.array(box.lower), np.array(box.upper)
    below = np.where((points < lower) & (points >= lower - slack), points, lower)
    beyond = np.where((points > upper) & (points <= upper + slack), points, upper)
    return below.min(axis=0), beyond.max(axis=0)


def _without_edges(
    part: FacedPart, corners: FloatArray, triangles: IntArray
) -> tuple[FloatArray, IntArray]:
    """Drop slivers of faces that a box only touches: pieces as thin as its tolerance."""
    owner = part.faces.label[triangles]
    kept = np.ones(len(triangles), dtype=bool)
    for face in np.unique(owner).tolist():
        own = owner == face
        extent = float(np.ptp(corners[own].reshape(-1, 3), axis=0).max())
        kept[own] = facet_areas(corners[own]).sum() > 3.0 * BOX_SHARE * part.diagonal * extent
    return corners[kept], triangles[kept]
