"""A case file to begin with: a part's faces as regions, and "?" for what only its user knows."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DraftCase:
    """A part with the regions that a case may name on it."""

    part: Part
    stated: Mapping[str, str]  #: Keys of ``[part]`` beside its file.
    regions: Mapping[str, Region]  #: Every one selects what its lines say.
    lines: Mapping[str, str]  #: TOML of each region.
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
    for name, keys in (*_file_names(part), *_holes(groups), *_flat_ends()):
        try:
            spec = {name: RegionSpec.model_validate(keys)}
            found = select_regions(part.surface, part.faces, spec, part.file_faces)[name]
        except (CaseError, ValidationError):
            # Not on this part, not told apart by these keys, or a name that no case can state.
            continue
        if any(_same(found, other) for other in regions.values()):
            continue
        key = next(k for k in chain([name], (f"{name}_{n}" for n in count(2))) if k not in regions)
        regions[key] = found
        lines[key] = "\n".join(f"{k} = {toml_value(value)}" for k, value in keys.items())
        lines[key] += _one_of(found, part)
    area = float(triangle_areas(part.surface.vertices, part.surface.faces).sum())
    # The mean chord of any body is 4 V / A (Cauchy).
    return DraftCase(
        part=part,
        stated=stated,
        regions=regions,
        lines=lines,
        others=tuple(g for g in groups if not (g.kind in _HOLLOW and _hole_name(g) in lines)),
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
    if "units" not in stated:
        raw = readers[suffix](path)
        if raw.unit is None and unit is None:
            box = " x ".join(f"{edge:.4g}" for edge in np.ptp(raw.corners.reshape(-1, 3), axis=0))
            raise CaseError(
                f"{path.name} carries no unit, and its box is {box} of them; state one of "
                + ", ".join(f'units="{unit}"' for unit in UNITS)
            )
        if raw.unit is None and unit is not None:
            shape = _shape(path, {**stated, "units": unit})
    return read_part(shape, {}, readers, Where(file=path.name))


def _shape(path: Path, stated: Mapping[str, str]) -> PartSpec:
    """``[part]`` of the draft: the part is copied beside its case, wherever a link leads."""
    context = {"folder": path.absolute().parent, "allow_outside": True}
    return PartSpec.model_validate({"file": path.name, **stated}, context=context)


def draft_text(draft: DraftCase, name: str, file_name: str) -> str:
    """The case file of a draft.

    ``name``: of the case. ``file_name``: of the part, beside the case file.
    """
    more = "".join(f"{key} = {toml_value(value)}\n" for key, value in draft.stated.items())
    regions = "\n\n".join(f"[region.{key}]\n{text}" for key, text in draft.lines.items())
    return f"""\
# State what stands as "?", leave out the regions that nothing needs, then: gradedesign check
[case]
name = {toml_value(name)}

[part]
file = {toml_value(file_name)}
{more}
# Faces that may be held or loaded.
{regions or "# None was found: see docs/parts.md for how regions are picked."}

[material]
name = "?"  # gradedesign materials lists them

# Solid behind faces that are bolted or loaded, one table each:
# [[keep]]
# region = "?"
# margin = "2 mm"

[[load_case]]
name = "load"
fix = [{{region = "?"}}]
load = [{{region = "?", force = ["? N", "? N", "? N"]}}]

[limits]
safety_factor = "?"  # a number, on the yield strength
# displacement = [{{region = "?", magnitude = "? mm"}}]

[lattice]
cell = "?"  # gradedesign cells lists them
size = "{draft.cell_size:g} mm"  # half of the part's mean thickness
"""


def _holes(groups: tuple[RoundShapes, ...]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Holes, slots and inner cones by size and direction, the largest faces first."""
    holes = sorted((g for g in groups if g.kind in _HOLLOW), key=lambda g: -g.area)
    for hole in holes[:_MOST_REGIONS]:
        key, stated = hole.keys
        name = _hole_name(hole)
        yield name, {key: stated, "count": hole.count}
        if key == "cylinder" and "span" not in stated:
            # Where half a bore, or the ends of a slot, have the same diameter.
            yield name, {key: {**stated, "span": _WHOLE}, "count": hole.count}
        if hole.count == 1 and key != "slot":
            # Where a boss or a rounding has the same diameter.
            point = _lengths(hole.points[0], hole.diameter)
            yield name, {key: {**stated, "point": point}, "count": 1}


def _hole_name(hole: RoundShapes) -> str:
    width = f"{hole.diameter:.4g}".replace(".", "_")
    word = _HOLLOW[hole.kind]
    return f"{word}_{width}" + ("" if hole.axis_name is None else f"_{hole.axis_name}")


def _file_names(part: Part) -> Iterator[tuple[str, dict[str, Any]]]:
    """Faces by the names that the file has for them."""
    if part.file_faces is None:
        return
    names = list(dict.fromkeys(part.file_faces.names.values()))
    for name in names[:_MOST_REGIONS]:
        plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower()[:_LETTERS]
        yield plain or "face", {"name": name}


def _flat_ends() -> Iterator[tuple[str, dict[str, Any]]]:
    """Flat faces on the sides of the part's box."""
    for axis in AXES:
        for side in ("min", "max"):
            yield f"{axis}_{side}", {"plane": f"{axis} = {side}"}


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


#: What to write for each "?" of a drafted case, by the keys that hold one.
_EXPECTED = {
    "keep[0].region": "where wanted: a region that stays solid, by its name",
    "material.name": 'a material that `gradedesign materials` lists, such as "Ti-6Al-4V"',
    "load_case[0].fix[0].region": "the region that is held, by its name",
    "load_case[0].load[0].region": "the region that is loaded, by its name",
    "load_case[0].load[0].force": 'force along x, y and z, such as ["0 N", "0 N", "-500 N"]',
    "limits.safety_factor": "a number above 1, such as 2: yield strength over stress",
    "limits.displacement[0].region": "where wanted: the region whose displacement is limited",
    "limits.displacement[0].magnitude": 'with it: how far it may move, such as "0.1 mm"',
    "lattice.cell": "a cell that `gradedesign cells` lists, by its name",
}
_TABLE = re.compile(r"(?:# )?(\[+)(\w+)\]+")
_ENTRY = re.compile(r'(\w+) = \[?"\?')


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenQuestion:
    """A "?" in a drafted case: its line, its key and how to answer it."""

    line: int
    key: str
    expected: str


def open_questions(text: str) -> tuple[OpenQuestion, ...]:
    """Every "?" of a drafted case `draft_text`, those in comments included, line by line."""
    found, table = [], ""
    for line, row in enumerate(text.splitlines(), start=1):
        header = _TABLE.match(row)
        if header:
            table = header[2] + ("[0]" if len(header[1]) > 1 else "")
        outer = row.removeprefix("# ").partition(" = ")[0]
        for name in _ENTRY.findall(row):
            key = f"{table}.{name}" if name == outer else f"{table}.{outer}[0].{name}"
            found.append(OpenQuestion(line=line, key=key, expected=_EXPECTED[key]))
    return tuple(found)
