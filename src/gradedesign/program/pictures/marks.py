"""Marks in the picture of the loading: regions of a case with their loads and supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.design.resolve.exclusion import exclusion_words
from gradedesign.geometry.contour.surface import extract_surface
from gradedesign.geometry.lattice.component import KEPT, SolidComponent
from gradedesign.geometry.lattice.domain import DesignDomain
from gradedesign.geometry.part.part import Part
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points
from gradedesign.mechanics.explicit.support_zones import SupportZone
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec, LoadSpec
from gradedesign.program.pictures.action_mark import ActionMark, Kind
from gradedesign.program.pictures.region_mark import RegionMark, Role

#: Steps along the longest edge of a volume as pictures draw it. Chosen, not measured.
_DRAWN = 48
#: The same along a zone around a support, which is thin beside it. Chosen, not measured.
_ZONE_DRAWN = 96
#: Steps through a zone around a support. Chosen, not measured.
_THIN = 4
#: How far below the part's faces pictures show it, over the part's diagonal. Chosen, not measured.
_BELOW = 2e-3


def region_marks(
    load_cases: Sequence[LoadCaseSpec],
    part: Part,
    domain: DesignDomain | None,
    zones: Sequence[SupportZone] = (),
) -> list[RegionMark]:
    """Supports, loaded and passive regions; one that is several is drawn as the first of these.

    Of volumes that stay solid, and of the zones around supports in which stress is not judged, what
    lies in the part is drawn; nothing of them without a domain.
    """
    roles: dict[str, Role] = {
        fix.region: "support" for load_case in load_cases for fix in load_case.fix
    }
    for load_case in load_cases:
        for load in load_case.load:
            roles.setdefault(load.region, "load")
    stay = [] if domain is None else [s for s in domain.solids if s.phase == KEPT]
    solid_regions = {solid.region for solid in stay if solid.region is not None}
    for name in solid_regions:
        roles.setdefault(name, "passive")
    mirrored = {fix.region for spec in load_cases for fix in spec.fix if fix.symmetry}
    said = {name: f"{name}, passive solid" for name in solid_regions if roles[name] != "passive"}
    said |= {name: f"{name}, plane of symmetry" for name in mirrored}
    marks = [
        RegionMark(
            name=said.get(name, name),
            role=role,
            corners=part.regions[name].corners,
        )
        for name, role in sorted(roles.items())
    ]
    if domain is None:
        return marks
    volumes = [
        RegionMark(
            name=solid.name.strip("'"),
            role="passive",
            corners=corner_points(_drawn(part, domain, solid, *solid.box)),
        )
        for solid in stay
        if solid.region is None and solid.box is not None
    ]
    return marks + volumes + [mark for zone in zones for mark in _zone_marks(domain, zone, part)]


def _zone_marks(domain: DesignDomain, zone: SupportZone, part: Part) -> list[RegionMark]:
    """Surface of a zone in the part; none where it is too thin beside its support to be drawn."""
    places = zone.corners.reshape(-1, 3)
    lower, upper = places.min(axis=0) - zone.radius, places.max(axis=0) + zone.radius
    step = max(zone.radius / _THIN, float((upper - lower).max()) / _ZONE_DRAWN)
    if zone.radius < step:
        return []
    below = _BELOW * part.diagonal

    def field(points: FloatArray) -> FloatArray:
        return np.maximum(zone.distance(points) - zone.radius, domain.distance(points)) + below

    drawn = extract_surface(field, lower, upper, step)
    name = f"stress not judged, {zone.radius:.3g} mm"
    return [RegionMark(name=name, role="unjudged", corners=corner_points(drawn))]


def _drawn(
    part: Part, domain: DesignDomain, solid: SolidComponent, lower: FloatArray, upper: FloatArray
) -> SurfaceMesh:
    """Surface of a solid in its box, coarse as pictures need it.

    A little below the part's faces, so that regions on them cover it, and as thick as a step of the
    picture at least.
    """
    below = min(_BELOW * part.diagonal, 0.1 * solid.least)
    step = float((upper - lower).max()) / _DRAWN
    more = max(step - 0.5 * solid.least, 0.0)

    def field(points: FloatArray) -> FloatArray:
        to_part = domain.distance(points)
        return np.maximum(solid.distance(points, to_part) - more, to_part) + below

    return extract_surface(field, lower - more, upper + more, step)


def action_marks(load_cases: Sequence[LoadCaseSpec], part: Part) -> list[ActionMark]:
    """Forces, pressures, moments, accelerations and prescribed displacements of all load cases."""
    return [mark for spec in load_cases for mark in _case_marks(spec, part)]


def warming_note(load_cases: Sequence[LoadCaseSpec]) -> str:
    """Changes of temperature, which no arrow shows."""
    warmed = [
        f"{spec.name} {spec.temperature_change:+g} K"
        for spec in load_cases
        if spec.temperature_change
    ]
    return f"change of temperature: {', '.join(warmed)}" if warmed else ""


def loads_note(
    load_cases: Sequence[LoadCaseSpec], zones: Sequence[SupportZone], share: float
) -> str:
    """Note below the picture: changes of temperature, and where stress is not judged.

    ``share`` is that of the part's volume in the zones.
    """
    around = exclusion_words(zones)
    unjudged = f"stress not judged within {around}, {share:.1%} of the part" if around else ""
    return "; ".join(words for words in (warming_note(load_cases), unjudged) if words)


def _case_marks(spec: LoadCaseSpec, part: Part) -> list[ActionMark]:
    marks = [mark for load in spec.load for mark in _load_marks(spec.name, load, part)]
    for fix in spec.fix:
        moved = np.array([value or 0.0 for value in fix.displacement])
        if moved.any():
            corners = part.regions[fix.region].corners
            text = f"{np.linalg.norm(moved):.4g} mm"
            marks.append(_mark(spec.name, "displacement", text, moved, corners))
    if any(spec.acceleration):
        size = float(np.linalg.norm(spec.acceleration)) / 1e3
        corners = corner_points(part.surface)
        marks.append(
            _mark(spec.name, "acceleration", f"{size:.4g} m/s^2", spec.acceleration, corners)
        )
    return marks


def _load_marks(case: str, load: LoadSpec, part: Part) -> list[ActionMark]:
    corners = part.regions[load.region].corners
    marks = []
    if load.force is not None and any(load.force):
        size = float(np.linalg.norm(load.force))
        text = f"{size:.4g} N" if load.point is None else f"{size:.4g} N remote"
        force = _mark(case, "force", text, load.force, corners)
        marks.append(force if load.point is None else replace(force, at=np.array(load.point)))
    bore = part.regions[load.region].bore
    if load.bearing is not None and any(load.bearing) and bore is not None:
        size = float(np.linalg.norm(load.bearing))
        pressed = bore.radial(corners.mean(axis=1).T).T @ load.bearing > 0.0
        text = f"{size:.4g} N bearing"
        marks.append(_mark(case, "force", text, load.bearing, corners[pressed]))
    if load.pressure:
        vector = (load.pressure, 0.0, 0.0)
        marks.append(_mark(case, "pressure", f"{load.pressure:.4g} MPa", vector, corners))
    if load.moment is not None and any(load.moment):
        size = float(np.linalg.norm(load.moment)) / 1e3
        marks.append(_mark(case, "moment", f"{size:.4g} N m", load.moment, corners))
    return marks


def _mark(case: str, kind: Kind, text: str, vector: object, corners: np.ndarray) -> ActionMark:
    return ActionMark(
        load_case=case,
        kind=kind,
        text=text,
        vector=np.asarray(vector, dtype=np.float64),
        corners=corners,
    )
