"""A case to begin with: the part, and its faces as regions."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from pydantic import ValidationError

from gradedesign.arrays import FloatArray
from gradedesign.common.values.locate import Where
from gradedesign.common.values.toml_text import toml_value
from gradedesign.design.case.run_schema import RunSpec
from gradedesign.design.case.schema import RegionSpec
from gradedesign.design.resolve.part_readers import part_readers
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import CaseError
from gradedesign.geometry.part.part import Part, read_part
from gradedesign.geometry.part.part_schema import UNITS, PartSpec
from gradedesign.geometry.part.raw_triangles import UNIT_MM, RawTriangles
from gradedesign.geometry.part.regions import Region, select_regions
from gradedesign.geometry.part.regions_schema import AXES
from gradedesign.geometry.part.round_shapes import RoundShapes, round_shapes
from gradedesign.geometry.triangles._surface_mesh_kernels import triangle_areas

#: Regions of each kind (named faces, holes) that are proposed. Chosen, not measured.
_MOST_REGIONS = 12
#: First word of the name of a region of hollow shapes.
_HOLLOW = {
    "hole": "hole",
    "half bore": "half_bore",
    "inner rounding": "hole",
    "slot": "slot",
    "countersink or inner cone": "cone",
}
#: What a wall all around spans, at least where facets of 12 around are missing.
_WHOLE = "360 deg"
#: Letters of a region's name that a name in the file gives. Chosen, not measured.
_LETTERS = 60
#: Share of a size below which a coordinate is rounding noise.
_NOISE = 1e-6
#: Name of a region, its keys, and the shape that they select.
_Candidate: TypeAlias = tuple[str, dict[str, Any], RoundShapes | None]
#: Longest edges of a part, mm, that cells of a few mm fit into and printers hold, and units in the
#: order in which they are tried. Chosen, not measured.
_USUAL_EDGES, _USUAL_UNITS = (10.0, 2000.0), ("mm", "inch", "cm", "m", "um")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DraftCase:
    """A part with the regions that a case may name on it."""

    part: Part
    stated: Mapping[str, str]  #: Keys of ``[part]`` beside its file.
    regions: Mapping[str, Region]  #: Every one selects what its lines say.
    lines: Mapping[str, str]  #: TOML of each region.
    shapes: Mapping[str, RoundShapes]  #: Holes, slots and inner cones among them.
    others: tuple[RoundShapes, ...]  #: Round shapes that are none of them.
    cell_size: float  #: mm. Half of the mean chord of the part.


def draft_case(
    path: Path,
    registry: Registry,
    *,
    units: str | None = None,
    auto: bool = False,
    bodies: str = "one",
) -> DraftCase:
    """Read a part and find the faces on which it may be held and loaded.

    Raises CaseError if there is no such file, no reader takes it, it holds voxels, or its unit is
    not known. Raises PartError if its geometry is damaged.

    - ``path``: the part's file
    - ``units``: one of `UNITS`, of its coordinates where the file carries none
    - ``auto``: whether damage is repaired that needs a choice, as ``[part] repair = "auto"`` does
    - ``bodies``: one of `BODIES`, as ``[part] bodies``
    """
    stated = {} if units is None else {"units": units}
    if auto:
        stated["repair"] = "auto"
    if bodies != "one":
        stated["bodies"] = bodies
    part = part_of_file(path, registry, stated)
    groups = round_shapes(part.surface, part.faces)
    regions: dict[str, Region] = {}
    lines: dict[str, str] = {}
    shapes: dict[str, RoundShapes] = {}
    for name, keys, shape in (*_file_names(part), *_holes(groups), *_flat_ends()):
        try:
            spec = {name: RegionSpec.model_validate(keys)}
            found = select_regions(part.surface, part.faces, spec, part.file_faces)[name]
        except (CaseError, ValidationError):
            # Not on this part, not told apart by these keys, or a name that no case can state.
            continue
        same = next((k for k, other in regions.items() if _same(found, other)), None)
        if same is not None:
            if shape is not None:  # a hole for which the file has a name
                shapes.setdefault(same, shape)
            continue
        key = next(k for k in chain([name], (f"{name}_{n}" for n in count(2))) if k not in regions)
        regions[key] = found
        if shape is not None:
            shapes[key] = shape
        lines[key] = "\n".join(f"{k} = {toml_value(value)}" for k, value in keys.items())
        lines[key] += _one_of(found, part)
    area = float(triangle_areas(part.surface.vertices, part.surface.faces).sum())
    # The mean chord of any body is 4 V / A (Cauchy).
    return DraftCase(
        part=part,
        stated=stated,
        regions=regions,
        lines=lines,
        shapes=shapes,
        others=tuple(g for g in groups if g not in shapes.values()),
        cell_size=float(f"{2.0 * part.volume / area:.2g}"),
    )


def part_of_file(
    path: Path, registry: Registry, stated: Mapping[str, str], unit: str | None = None
) -> Part:
    """Read a file with these keys of ``[part]`` and none else; errors as of `draft_case`.

    ``unit``: of a file that carries none, where none is stated.
    """
    if not path.is_file():
        raise CaseError(f"{path}: no such file; expected the file of a part")
    shape = _shape(path, stated)
    readers = part_readers(shape, RunSpec().memory, registry)
    suffix = path.suffix.lower()
    for reader in registry.readers.values():
        if reader.key and suffix in reader.suffixes:
            raise CaseError(
                f"{path.name} is read as only its user can say: write the case with a table "
                f"[part.{reader.key}], see docs/parts.md"
            )
    if "units" not in stated and (edges := _edges_without_unit(readers[suffix](path))):
        if unit is None:
            raise UnitError(path.name, edges)
        shape = _shape(path, {**stated, "units": unit})
    return read_part(shape, {}, readers, Where(file=path.name))


class UnitError(CaseError):
    """A file carries no unit, and none was stated; with the likeliest one and why."""

    def __init__(self, name: str, edges: tuple[float, ...]) -> None:
        least, most = _USUAL_EDGES
        fitting = (u for u in _USUAL_UNITS if least <= UNIT_MM[u] * max(edges) <= most)
        box = " x ".join(f"{edge:.4g}" for edge in edges)
        self.box = f"{name} carries no unit, and its box is {box} of them"
        self.unit = next(fitting, UNITS[0])
        in_mm = " x ".join(f"{UNIT_MM[self.unit] * edge:.4g}" for edge in edges)
        tried = ", ".join(_USUAL_UNITS)
        self.why = f"then {in_mm} mm; first of {tried} to make it {least:g} to {most:g} mm long"
        words = ", ".join(f'units="{unit}"' for unit in UNITS)
        super().__init__(f"{self.box}; state one of {words}; likely {self.unit}: {self.why}")


def _edges_without_unit(raw: RawTriangles) -> tuple[float, ...]:
    """Edges of the box of a file that carries no unit; empty of one that does."""
    return tuple(np.ptp(raw.corners.reshape(-1, 3), axis=0).tolist()) if raw.unit is None else ()


def _shape(path: Path, stated: Mapping[str, str]) -> PartSpec:
    """``[part]`` of the draft: the part is copied beside its case, wherever a link leads."""
    context = {"folder": path.absolute().parent, "allow_outside": True}
    return PartSpec.model_validate({"file": path.name, **stated}, context=context)


def _holes(groups: tuple[RoundShapes, ...]) -> Iterator[_Candidate]:
    """Holes, slots and inner cones by size and direction, the largest faces first."""
    holes = sorted((g for g in groups if g.kind in _HOLLOW), key=lambda g: -g.area)
    for hole in holes[:_MOST_REGIONS]:
        key, stated = hole.keys
        name = _hole_name(hole)
        yield name, {key: stated, "count": hole.count}, hole
        if key == "cylinder" and "span" not in stated:
            # Where half a bore, or the ends of a slot, have the same diameter.
            yield name, {key: {**stated, "span": _WHOLE}, "count": hole.count}, hole
        if hole.count == 1 and key != "slot":
            # Where a boss or a rounding has the same diameter.
            point = _lengths(hole.points[0], hole.diameter)
            yield name, {key: {**stated, "point": point}, "count": 1}, hole


def _hole_name(hole: RoundShapes) -> str:
    width = f"{hole.diameter:.4g}".replace(".", "_")
    word = _HOLLOW[hole.kind]
    return f"{word}_{width}" + ("" if hole.axis_name is None else f"_{hole.axis_name}")


def _file_names(part: Part) -> Iterator[_Candidate]:
    """Faces by the names that the file has for them."""
    if part.file_faces is None:
        return
    names = list(dict.fromkeys(part.file_faces.names.values()))
    for name in names[:_MOST_REGIONS]:
        plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower()[:_LETTERS]
        yield plain or "face", {"name": name}, None


def _flat_ends() -> Iterator[_Candidate]:
    """Flat faces on the sides of the part's box."""
    for axis in AXES:
        for side in ("min", "max"):
            yield f"{axis}_{side}", {"plane": f"{axis} = {side}"}, None


def _one_of(region: Region, part: Part) -> str:
    """Comment on how to take one of several faces."""
    if len(region.faces) < 2:
        return ""
    face = part.faces.faces[region.faces[0]]
    point = face.centroid if face.point is None else face.point
    at = toml_value(_lengths(point, part.diagonal))
    return f"\n# nearest = {at} with count = 1 takes one of them"


def _lengths(point: FloatArray, size: float) -> list[str]:
    """Coordinates as a case states them, without rounding noise beside a size, mm."""
    return [f"{0.0 if abs(x) < _NOISE * size else x:.6g} mm" for x in point]


def _same(a: Region, b: Region) -> bool:
    return np.array_equal(np.sort(a.triangles), np.sort(b.triangles))
