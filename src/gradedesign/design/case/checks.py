"""Checks that span several tables of a case: names that must exist, sizes that must fit."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

from gradedesign.common.values.problems import Problem
from gradedesign.common.values.suggest import shown
from gradedesign.common.values.toml_lines import Key
from gradedesign.common.values.value_types import Triple
from gradedesign.design.case.material_checks import beyond_yield, material_warnings
from gradedesign.design.case.schema import CaseFile
from gradedesign.design.case.wall_checks import (
    feather_problems,
    grid_problems,
    outer_problems,
    stated_problems,
    wall_problems,
)
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.mechanics.limits.limit_checks import displacement_warnings, repeated_limits
from gradedesign.mechanics.material.material_schema import MaterialSpec

_ANY = "*"
#: A part needs a few dozen regions; many more are made by a script and would make every command
#: slow. Chosen, not measured.
_MOST_REGIONS = 300
_USES_OF_REGIONS: tuple[Key, ...] = (
    ("keep", _ANY, "region"),
    ("keep", _ANY, "body", "region"),
    ("zone", _ANY, "region"),
    ("zone", _ANY, "body", "region"),
    ("lattice", "skin", "faces"),
    ("lattice", "skin", "faces", _ANY),
    ("lattice", "skin", _ANY, "faces"),
    ("lattice", "skin", _ANY, "faces", _ANY),
    ("load_case", _ANY, "fix", _ANY, "region"),
    ("load_case", _ANY, "load", _ANY, "region"),
    ("limits", _ANY, _ANY, "region"),
)
_PARTS_OF_REGIONS = tuple(
    key
    for word in ("any", "all", "not")
    for key in (("region", _ANY, word), ("region", _ANY, word, _ANY))
)


def reference_problems(data: Mapping[str, Any]) -> Iterator[Problem]:
    """Find names that are used but not defined, defined twice, or defined by themselves.

    ``data``: the file as TOML gave it; may be wrong in any other way.
    """
    regions = _names(data.get("region"))
    if len(regions) > _MOST_REGIONS:
        yield Problem(
            key=("region",),
            message=f"found {len(regions)} regions; expected at most {_MOST_REGIONS}",
        )
    for pattern in (*_USES_OF_REGIONS, *_PARTS_OF_REGIONS):
        for key, name in _texts(data, pattern):
            if name not in regions:
                yield Problem(
                    key=key,
                    message=f"region {shown(name)} is not defined",
                    word=name,
                    choices=regions,
                    label="defined",
                )
    yield from _cycles(data, regions)
    cases = list(_texts(data, ("load_case", _ANY, "name")))
    counts = Counter(name for _, name in cases)
    for key, name in cases:
        if counts[name] > 1 and key != next(k for k, n in cases if n == name):
            yield Problem(
                key=key, message=f"load case {shown(name)} is defined twice; expected another name"
            )
    for key, name in _texts(data, ("limits", _ANY, _ANY, "load_case")):
        if name not in counts:
            yield Problem(
                key=key,
                message=f"load case {shown(name)} is not defined",
                word=name,
                choices=tuple(counts),
                label="defined",
            )


def cross_problems(file: CaseFile) -> Iterator[Problem]:
    """Find values of different tables that contradict each other."""
    if file.lattice.stated:
        yield from stated_problems(file)
    elif file.limits.empty:
        yield Problem(
            key=("limits",),
            message='no limit given; add stress = "50 MPa", safety_factor = 2 or '
            'displacement = [{region = "tip", magnitude = "2 mm"}]',
        )
    if file.material is not None:
        yield from _material_problems(file, file.material)
    yield from wall_problems(file.lattice, file.print)
    yield from feather_problems(file.print)
    yield from grid_problems(file.lattice, file.run)
    orientation = file.lattice.orientation
    names = tuple(case.name for case in file.load_case)
    if (
        orientation is not None
        and not file.lattice.stated
        and orientation.load_case is not None
        and orientation.load_case not in names
    ):
        yield Problem(
            key=("lattice", "orientation", "load_case"),
            message=f"load case {shown(orientation.load_case)} is not defined",
            word=orientation.load_case,
            choices=names,
            label="defined",
        )
    yield from repeated_limits(file.limits, names)
    if file.limits.judged is not None and file.process is None:
        yield Problem(
            key=("limits", "judged"),
            message=f'found "{file.limits.judged}" without [process], so that the designed body is '
            'the only one; add [process] with name = "..." (gradedesign processes lists them), or '
            "leave it out",
        )
    yield from _cell_map_problems(file.lattice, file.region)
    yield from _zone_problems(file)
    yield from outer_problems(file.lattice, file.print)
    yield from _box_problems(file)


def _material_problems(file: CaseFile, material: MaterialSpec) -> Iterator[Problem]:
    """Find limits and loads for which a stated material lacks a value."""
    limits, own = file.limits, material.name is None
    if limits.safety_factor is not None and own and material.yield_strength is None:
        yield Problem(
            key=("limits", "safety_factor"),
            message="needs the yield strength; add yield_strength to [material], or use stress",
        )
    if own and material.youngs_modulus is not None:
        strength = math.nan if material.yield_strength is None else material.yield_strength
        if words := beyond_yield(
            limits, strength, material.youngs_modulus, name="the stated material"
        ):
            yield Problem(key=("limits", "stress"), message=words)
    for i, case in enumerate(file.load_case):
        if case.temperature_change and own and material.thermal_expansion is None:
            yield Problem(
                key=("load_case", i, "temperature_change"),
                message="needs the thermal expansion; add thermal_expansion to [material]",
            )


def _cell_map_problems(lattice: LatticeSpec, regions: Mapping[str, Any]) -> Iterator[Problem]:
    """Find regions that a cell map names and nobody defines."""
    cell_map = lattice.cell_map
    if cell_map is None:
        return
    for key, name in (("surface", cell_map.surface), ("opposite", cell_map.opposite)):
        if name is not None and name not in regions:
            yield Problem(
                key=("lattice", "cell_map", key),
                message=f"region {shown(name)} is not defined",
                word=name,
                choices=tuple(regions),
                label="defined",
            )


def _zone_problems(file: CaseFile) -> Iterator[Problem]:
    """Find keys that cannot be combined with zones, and zones with equal names."""
    lattice = file.lattice
    for key in ("transition", "parameter_map"):
        if file.zone and getattr(lattice, key) is not None:
            yield Problem(key=("lattice", key), message="does not go with [[zone]]; leave one out")
    if file.zone and (not lattice.cells or lattice.any_phase):
        yield Problem(
            key=("zone",),
            message=f"zones tell cells apart, which phases = {json.dumps(lattice.made)} "
            f"{'may ' if lattice.cells else ''}leave out; leave the zones out too",
        )
    for i, zone in enumerate(file.zone):
        if zone.phases is not None and not lattice.members:
            yield Problem(
                key=("zone", i, "phases"),
                message="zones keep solid members out, and [lattice] makes none; expected "
                'phases = ["lattice", "solid"] there, or none here',
            )
    mixed = lattice.transition is not None or lattice.parameter_map is not None
    if not file.zone and (lattice.stated or not mixed):
        return
    by = "[[zone]]" if file.zone else "a transition or a parameter by place"
    for key, stated in (("grading", lattice.graded_size), ("orientation", lattice.orientation)):
        if stated:
            yield Problem(
                key=("lattice", key),
                message=f"does not go with {by} yet: all cells share one grid that no design "
                "moves; leave one out",
            )
    names = Counter(zone.name for zone in file.zone if zone.name is not None)
    for i, zone in enumerate(file.zone):
        if zone.name is not None and (names[zone.name] > 1 or zone.name == "lattice"):
            yield Problem(
                key=("zone", i, "name"),
                message=f"found {shown(zone.name)}, which is the name of another zone or of what "
                f"lies in none",
            )


def _skin_problems(lattice: LatticeSpec, box: Triple) -> Iterator[Problem]:
    """Find skins that leave no room in a box of these edges, mm.

    One on some faces may meet the opposite side, but not across the longest edge.
    """
    for skin in lattice.skin:
        most = max(box) if skin.faces else min(box) / 2
        if skin.thickness[1] >= most:
            yield Problem(
                key=("lattice", "skin"),
                message=f"found {skin.thickness[1]:g} mm, which leaves no room inside the "
                f"{max(box) if skin.faces else min(box):g} mm edge of the box; expected less than "
                f"{most:g} mm",
            )


def case_warnings(file: CaseFile) -> Iterator[Problem]:
    """Values that are allowed but unusual; reported as warnings."""
    material = file.material
    nu = None if material is None else material.poissons_ratio
    if nu is not None and nu > 0.49:
        yield Problem(
            key=("material", "poissons_ratio"),
            message=f"found {nu:g}, nearly incompressible; elements may lock and appear too stiff "
            f"above 0.49",
        )
    if material is not None:
        yield from material_warnings(material)
    yield from displacement_warnings(file.limits)
    for i, case in enumerate(file.load_case):
        fixed_regions = {fix.region for fix in case.fix if None not in fix.displacement}
        for k, load in enumerate(case.load):
            if load.region in fixed_regions:
                yield Problem(
                    key=("load_case", i, "load", k),
                    message=f"load case {shown(case.name)} loads region {shown(load.region)}, "
                    f"which it also holds in every direction; that load does nothing",
                )


def _box_problems(file: CaseFile) -> Iterator[Problem]:
    if file.part.box is None:
        return
    thinnest = min(file.part.box)
    yield from _skin_problems(file.lattice, file.part.box)
    if file.part.mesh_size is not None and file.part.mesh_size > thinnest:
        yield Problem(
            key=("part", "mesh_size"),
            message=f"found {file.part.mesh_size:g} mm, more than the {thinnest:g} mm edge of the "
            f"box; expected at most {thinnest / 2:g} mm",
        )


def _cycles(data: Mapping[str, Any], regions: tuple[str, ...]) -> Iterator[Problem]:
    """Report every region that is, through others, part of its own definition."""
    parts: dict[str, list[str]] = {name: [] for name in regions}
    for pattern in _PARTS_OF_REGIONS:
        for key, name in _texts(data, pattern):
            if name in parts:
                parts[str(key[1])].append(name)
    # take away regions whose parts are all settled; what stays depends on a cycle
    open_parts = {name: set(of) for name, of in parts.items()}
    users: dict[str, list[str]] = {name: [] for name in regions}
    for name, of in open_parts.items():
        for part in of:
            users[part].append(name)
    settled = [name for name, of in open_parts.items() if not of]
    while settled:
        part = settled.pop()
        for user in users[part]:
            open_parts[user].discard(part)
            if not open_parts[user]:
                settled.append(user)
        del open_parts[part]
    for name, of in open_parts.items():
        yield Problem(
            key=("region", name),
            message=f"is defined by itself, through {shown(min(of))}; expected no circle among "
            "any, all and not",
        )


def _names(table: object) -> tuple[str, ...]:
    return tuple(table) if isinstance(table, dict) else ()


def _texts(data: object, pattern: Key, key: Key = ()) -> Iterator[tuple[Key, str]]:
    """Yield the texts at every key that fits a pattern; ``*`` stands for any key or index."""
    if not pattern:
        if isinstance(data, str):
            yield key, data
        return
    first, rest = pattern[0], pattern[1:]
    if isinstance(data, dict):
        for name in data if first == _ANY else (first,):
            if name in data:
                yield from _texts(data[name], rest, (*key, name))
    elif isinstance(data, list) and first == _ANY:
        for i, entry in enumerate(data):
            yield from _texts(entry, rest, (*key, i))
