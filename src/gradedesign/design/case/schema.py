"""The case: everything the user states, checked and in mm, N, MPa, t/mm^3, K, s, bytes, degrees.

:class:`CaseFile` is the layout of the file; :class:`Case` is what the program works with. The
tables they are made of are re-exported here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import GenericAlias
from typing import Any, ClassVar, NamedTuple, TypeAlias, TypeVar, cast

from pydantic import Field, SerializeAsAny, create_model

from gradedesign.common.values.locate import Where
from gradedesign.common.values.shown_record import ShownRecord
from gradedesign.common.values.table import Table
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.common.values.value_types import Name, RegionName
from gradedesign.design.case.run_schema import OutputSpec, RunSpec
from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.design.printing.process_schema import ProcessSpec
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.lattice.zone_schema import ZoneSpec
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.place_schema import KeepSpec
from gradedesign.geometry.part.regions_schema import BoxSpec, CylinderSpec, PlaneSpec, RegionSpec
from gradedesign.mechanics.fe.load_schema import FixSpec, LoadCaseSpec, LoadSpec
from gradedesign.mechanics.limits.limits_schema import (
    DisplacementLimit,
    Exclusion,
    LimitsSpec,
    SolidMultiple,
)
from gradedesign.mechanics.material.material_schema import MaterialSpec

__all__ = [
    "BoxSpec",
    "Case",
    "CaseFile",
    "CaseSection",
    "CylinderSpec",
    "DisplacementLimit",
    "Exclusion",
    "FixSpec",
    "KeepSpec",
    "LatticeSpec",
    "LimitsSpec",
    "LoadCaseSpec",
    "LoadSpec",
    "MaterialSpec",
    "OutputSpec",
    "PartSpec",
    "PlaneSpec",
    "PrintSpec",
    "ProcessSpec",
    "RegionSpec",
    "RunSpec",
    "SolidMultiple",
    "ZoneSpec",
    "schema_json",
]


class CaseSection(Table):
    """Name of the case."""

    name: Name = Field(examples=["cantilever"])
    """Shown in the report."""


class CaseFile(Table):
    """Layout of a case file: its tables by name."""

    called: ClassVar[Mapping[str, str]] = {
        "constraints": "limits",
        "geometry": "part",
        "passive": "keep",
        "printer": "print",
        "supports": "load_case",
        "loads": "load_case",
        "filling": "lattice",
    }

    #: Tables that a case needs unless it states the density of its lattice.
    analysed: ClassVar[tuple[str, ...]] = ("material", "load_case", "limits")

    case: CaseSection
    part: PartSpec
    region: dict[RegionName, RegionSpec] = Field(default_factory=dict)
    material: MaterialSpec | None = None
    keep: tuple[KeepSpec, ...] = ()
    load_case: tuple[LoadCaseSpec, ...] = ()
    limits: LimitsSpec = Field(default_factory=LimitsSpec)
    lattice: LatticeSpec
    zone: tuple[ZoneSpec, ...] = ()
    print: PrintSpec | None = None
    process: ProcessSpec | None = None
    run: RunSpec = Field(default_factory=RunSpec)
    output: OutputSpec = Field(default_factory=OutputSpec)


class CaseName(NamedTuple):
    """By which a result and its files are told from those of other cases."""

    name: str
    """Shown in the report."""
    hash: str
    """See `Case.case_hash`."""


class Case(ShownRecord, Table):
    """A case as read: the tables of its file, where it lies, and its identity."""

    name: str
    """Shown in the report."""
    path: Path
    """The case file, absolute."""
    folder: Path
    """The folder of the case file, absolute."""
    # Tables that readers and lists that kinds of limits brought are part of what is asked.
    part: SerializeAsAny[PartSpec]
    region: dict[str, RegionSpec]
    material: MaterialSpec | None
    """None only where the density is stated."""
    keep: tuple[KeepSpec, ...]
    load_case: tuple[LoadCaseSpec, ...]
    limits: SerializeAsAny[LimitsSpec]
    lattice: SerializeAsAny[LatticeSpec]
    zone: tuple[ZoneSpec, ...]
    print: PrintSpec | None
    process: ProcessSpec | None
    run: RunSpec
    output: OutputSpec
    case_hash: str
    """SHA-256 of the content in internal units and of the bytes of the part file, hex."""
    warnings: tuple[str, ...] = ()
    """Warnings about values that are allowed but unusual."""
    lines: dict[str, int] = Field(default_factory=dict, repr=False)
    """Line of every key of the file, by dotted path such as ``load_case[0].load[1].force``."""

    @property
    def named(self) -> CaseName:
        """Its name and hash."""
        return CaseName(self.name, self.case_hash)

    @property
    def where(self) -> Where:
        """Where its keys stand in the file."""
        return Where(file=self.path.name, lines=self.lines, layout=type(self))


#: What a case needs beside its required tables, in a schema: those of an analysis, unless the
#: density is stated.
_ANALYSED: Mapping[str, Any] = {
    "if": {
        "properties": {
            "lattice": {
                "anyOf": [
                    {"required": ["density_map"]},
                    {
                        "required": ["density"],
                        "properties": {"density": {"type": ["number", "string"]}},
                    },
                ]
            }
        }
    },
    "else": {"required": list(CaseFile.analysed)},
}


def _stated(value: Any, key: Mapping[str, Any]) -> Any:
    """A default as a case would state it: quantities with their unit."""
    if isinstance(value, list):
        return [_stated(entry, key.get("items", {})) for entry in value]
    return DIMENSIONS[key["x-dimension"]].words(value) if "x-dimension" in key else value


Layout = TypeVar("Layout", bound=Table)


@dataclass(frozen=True, slots=True, kw_only=True)
class Brought:
    """Keys that plugins add to a case file."""

    #: By key. Lists of ``[limits]``, of registered kinds of limits.
    limits: Mapping[str, type[Table]] = field(default_factory=dict)
    #: By key. Tables of ``[part]``, of registered readers.
    part: Mapping[str, type[Table]] = field(default_factory=dict)
    #: By key. Lists of ``[lattice]``, of registered kinds of components.
    lattice: Mapping[str, type[Table]] = field(default_factory=dict)


def with_brought(layout: type[Layout], brought: Brought) -> type[Layout]:
    """A layout of a case file with the keys that plugins add; the same class for the same keys."""
    keys = (brought.limits, brought.lattice, brought.part)
    if not any(keys):
        return layout
    return cast("type[Layout]", _with_keys(layout, *(tuple(entries.items()) for entries in keys)))


#: Keys of plugins with their tables, in an order.
_Keys: TypeAlias = tuple[tuple[str, type[Table]], ...]


@cache
def _with_keys(layout: type[Table], limits: _Keys, lattice: _Keys, part: _Keys) -> type[Table]:
    """The layout with lists of limits and of components and tables of the part."""
    changed: dict[str, Any] = {}
    if limits:
        lists = _with_lists(LimitsSpec, limits)
        changed["limits"] = (lists, Field(default_factory=lists))
    if lattice:
        changed["lattice"] = (_with_lists(LatticeSpec, lattice), ...)
    if part:
        fields: dict[str, Any] = {key: (table | None, None) for key, table in part}
        changed["part"] = (
            create_model("PartSpec", __base__=PartSpec, __doc__=PartSpec.__doc__, **fields),
            ...,
        )
    return create_model(layout.__name__, __base__=layout, **changed)


def _with_lists(table: type[Layout], lists: _Keys) -> type[Layout]:
    """A table with further lists of tables."""
    fields: dict[str, Any] = {
        name: (GenericAlias(tuple, (entry, ...)), ()) for name, entry in lists
    }
    return create_model(table.__name__, __base__=table, __doc__=table.__doc__, **fields)


def schema_json(layout: type[Table] = CaseFile, brought: Brought | None = None) -> dict[str, Any]:
    """JSON schema of a case file, for completion and checks in editors.

    ``layout``: of the file. ``brought``: keys of plugins.

    Returns
    -------
    dict
        Draft 7, which editors of TOML read; describes the text that is written, not the converted
        values. What holds across keys or needs a file is left to ``gradedesign check``.
    """
    schema = with_brought(layout, brought or Brought()).model_json_schema(
        by_alias=True, ref_template="#/definitions/{model}"
    )
    definitions = schema.pop("$defs")
    for body in definitions.values():
        for key in body["properties"].values():
            default = key.pop("default", None)
            if default not in (None, [], {}):  # these three are how a key is not stated
                key["default"] = _stated(default, key)
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        **schema,
        **(_ANALYSED if layout is CaseFile else {}),
        "definitions": definitions,
    }
