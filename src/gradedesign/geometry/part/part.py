"""The part: a closed surface, its smooth faces and the regions the case names on it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where, locating
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.common.values.suggest import instead
from gradedesign.errors import CaseError
from gradedesign.geometry.part.bodies import bodies_with
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.part.exact_faces import exact_faces
from gradedesign.geometry.part.file_faces import FileBody, FileFaces, carried
from gradedesign.geometry.part.mended import Mend, mended, require_kept_bodies
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.place_schema import BodySpec
from gradedesign.geometry.part.raw_triangles import UNIT_MM, RawTriangles, in_mm
from gradedesign.geometry.part.regions import Region, select_regions
from gradedesign.geometry.part.regions_schema import RegionSpec
from gradedesign.geometry.part.repair import RepairReport, build_surface
from gradedesign.geometry.part.smooth_faces import SmoothFaces, segment_faces
from gradedesign.geometry.part.unit_question import questioning_unit
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points, enclosed_volume

log = logging.getLogger(__name__)

#: Reads one file format.
Reader: TypeAlias = Callable[[Path], RawTriangles]
#: Of a case that names none.
_NO_BODIES: Mapping[str, BodySpec] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Part(ShownRecord):
    """The solid part."""

    surface: SurfaceMesh  #: Closed, outward.
    #: Its smooth faces, found when they are asked for first; ``faces`` calls it.
    find_faces: Callable[[], SmoothFaces]
    #: Faces, names and colours of the file on the triangles of ``surface``.
    file_faces: FileFaces | None
    units: str | None  #: Unit in which the file was read; None for a box.
    #: mm. Within which the triangles follow the curved faces of the file, where it has them.
    chord_tolerance: float | None
    regions: Mapping[str, Region]  #: In the order of the case.
    volume: float  #: mm^3.
    diagonal: float  #: mm. Of the bounding box.
    source: str  #: Name of the file, or ``box``.
    report: RepairReport  #: Repairs, with all warnings of reading.
    #: Closed surfaces of the bodies that the case names.
    bodies: Mapping[BodySpec, SurfaceMesh] = field(default_factory=dict)
    #: Bodies of the file that were subtracted from the part or left out of it.
    file_bodies: tuple[FileBody, ...] = ()

    @property
    def faces(self) -> SmoothFaces:
        """Smooth faces of the surface."""
        return self.find_faces()


def read_part(
    spec: PartSpec,
    regions: Mapping[str, RegionSpec],
    readers: Mapping[str, Reader],
    where: Where,
    *,
    bodies: Mapping[str, BodySpec] = _NO_BODIES,
    mend: Mend | None = None,
) -> Part:
    """Read or build a part and find its regions.

    Raises CaseError if no reader takes the file, its unit is missing, or a region cannot be found.
    Raises PartError if the geometry is damaged beyond what ``repair`` allows.

    - ``regions``: by name
    - ``readers``: by lower-case suffix, such as ``".stl"``
    - ``where``: names file and line of a key of the case
    - ``bodies``: bodies that the case names, by their keys, such as ``keep[0].body``
    - ``mend``: the repairer that ``[part] repair`` names, where it is a plugin's
    """
    start = time.perf_counter()
    file_faces: FileFaces | None = None
    units: str | None = None
    chord_tolerance: float | None = None
    file_bodies: tuple[FileBody, ...] = ()
    if spec.file is not None:
        raw, units = _read_file("part", spec.units, spec.file, readers)
        source, chord_tolerance = spec.file.name, raw.chord_tolerance
        file_bodies = raw.file_bodies
        surface, report, moved = _built(spec, raw, mend, source)
        if raw.faces is not None:
            tolerance = max(10.0 * report.weld_tolerance, moved)
            file_faces = carried(raw.faces, raw.corners, surface, tolerance=tolerance)
        report = replace(report, warnings=(*raw.warnings, *report.warnings))
    elif spec.box is not None:
        box = corner_points(box_surface(spec.box))
        surface, report = build_surface(box, source="box")
        source = "box"
    else:
        raise CaseError('part: neither file nor box is given; add e.g. file = "part.stl"')

    @cache
    def find_faces() -> SmoothFaces:
        if file_faces is not None and file_faces.surfaces:
            return exact_faces(surface, file_faces)
        return segment_faces(surface)

    found: Mapping[str, Region] = {}
    if regions:
        with questioning_unit(surface, regions, file_faces, units):
            found = select_regions(surface, find_faces(), regions, file_faces)
    surfaces, notes = _bodies(bodies, surface, found, readers, where)
    notes = [*region_notes(found, regions), *notes]
    part = Part(
        surface=surface,
        find_faces=find_faces,
        file_faces=file_faces,
        units=units,
        chord_tolerance=chord_tolerance,
        regions=found,
        volume=enclosed_volume(surface),
        diagonal=float(np.linalg.norm(np.ptp(surface.vertices, axis=0))),
        source=source,
        report=replace(report, warnings=(*report.warnings, *notes)),
        bodies=surfaces,
        file_bodies=file_bodies,
    )
    seconds, count = time.perf_counter() - start, len(surface.faces)
    log.info("%s: %.4g mm^3, %d triangles, %.2f s", source, part.volume, count, seconds)
    return part


def _built(
    spec: PartSpec, raw: RawTriangles, mend: Mend | None, source: str
) -> tuple[SurfaceMesh, RepairReport, float]:
    """The surface as gradedesign or a repairer mends it, and how far it was moved, mm."""
    if mend is None:
        surface, report = build_surface(
            raw.corners, repair=spec.repair, bodies=spec.bodies, source=source
        )
        return surface, report, 0.0
    made = mended(raw.corners, mend, name=spec.repair, source=source)
    surface, report = build_surface(made.corners, bodies=spec.bodies, source=source)
    counts = {key: count + getattr(report, key) for key, count in made.counts.items()}
    joined = require_kept_bodies(
        raw.corners, report.bodies, bodies=spec.bodies, name=spec.repair, source=source
    )
    notes = (*made.notes, *joined, *report.warnings)
    report = replace(
        report, facets_read=len(raw.corners), repairer=made.changes, warnings=notes, **counts
    )
    return surface, report, made.moved


def _bodies(
    stated: Mapping[str, BodySpec],
    surface: SurfaceMesh,
    regions: Mapping[str, Region],
    readers: Mapping[str, Reader],
    where: Where,
) -> tuple[dict[BodySpec, SurfaceMesh], list[str]]:
    """Bodies that the case names, and remarks on reading them."""
    bodies: dict[BodySpec, SurfaceMesh] = {}
    notes: list[str] = []
    for key, body in stated.items():
        if body.region is not None:
            with locating(where, f"{key}.region"):
                bodies[body] = bodies_with(surface, regions[body.region].triangles)
        elif body.file is not None:
            with locating(where, f"{key}.file"):
                raw, _ = _read_file(key, body.units, body.file, readers)
                bodies[body], report = build_surface(
                    raw.corners, bodies="all", source=body.file.name
                )
            notes += [*raw.warnings, *report.warnings]
    return bodies, notes


def _read_file(
    key: str, units: str | None, path: Path, readers: Mapping[str, Reader]
) -> tuple[RawTriangles, str]:
    """Triangles of a file in mm, and the unit that it was read in."""
    read = readers.get(path.suffix.lower())
    if read is None:
        suffix = path.suffix.lower()
        near = supplied_by("suffixes", suffix) or instead(suffix, sorted(readers), label="readable")
        raise CaseError(f"{key}.file: found {path.name}, which no reader takes; {near}")
    raw = read(path)
    unit = units or raw.unit
    if unit is None:
        raise CaseError(
            f"{key}.units: missing; {path.name} carries no unit, state one of {', '.join(UNIT_MM)}"
        )
    scaled = in_mm(raw, unit, path.name)
    if raw.unit not in (None, unit):
        warning = f"{path.name}: read in {unit} as {key}.units says, though its unit is {raw.unit}"
        scaled = replace(scaled, warnings=(*scaled.warnings, warning))
    return scaled, unit


#: A surface that makes this angle with ``facing`` is a side and no longer the face that was meant,
#: degrees; more than the 45 degrees at which a rounded edge ends and its neighbour begins.
_TURNED_AWAY = 60.0
#: Share of a region's area that may be turned away without a word, as rounded rims are. Chosen, not
#: measured.
_TURNED_SHARE = 0.05


def region_notes(regions: Mapping[str, Region], specs: Mapping[str, RegionSpec]) -> list[str]:
    """Warn of regions chosen by ``facing`` of whose area a part faces elsewhere.

    ``facing`` compares the mean normal of a smooth face. A face that runs on around an edge, as
    faces of scans and of rounded solids do, fits by its mean and brings its sides along.
    """
    notes = []
    for name, region in regions.items():
        spec = specs[name]
        if spec.facing_vector is None:
            continue
        away = _turned_share(region, np.array(spec.facing_vector))
        if away > _TURNED_SHARE:
            notes.append(
                f"region.{name}: {100.0 * away:.0f} % of its {region.area:.4g} mm^2 is turned more "
                f"than {_TURNED_AWAY:g} deg away from {spec.facing}: the smooth face curves away "
                "or runs on around an edge; if only its front is meant, cut it out by a box with "
                "clip = true"
            )
    return notes


def _turned_share(region: Region, vector: FloatArray) -> float:
    """Share of a region's area whose normal is turned away from a unit vector."""
    a, b, c = np.moveaxis(region.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    twice = np.linalg.norm(normal, axis=1)
    away = normal @ vector < np.cos(np.radians(_TURNED_AWAY)) * twice
    return float(twice[away].sum() / twice.sum())
