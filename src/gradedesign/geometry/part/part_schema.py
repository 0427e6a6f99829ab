"""``[part]``: the solid, from a file or a box."""

from __future__ import annotations

from math import isfinite
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator, model_validator

from gradedesign.common.values.suggest import shown
from gradedesign.common.values.table import Table, key_error
from gradedesign.common.values.value_types import (
    Choice,
    FilePath,
    JsonSchema,
    Quantity,
    Reader,
    Refused,
    Size,
    Text,
    Triple,
    Vector,
)
from gradedesign.errors import CaseError
from gradedesign.geometry.part.part_path import (
    resolve_data_file,
    resolve_data_folder,
    resolve_part_file,
)

#: Ways of repair that need no plugin; the last one rebuilds the whole surface on a grid.
REBUILD = "rebuild"
OWN_REPAIRS = ("safe", "auto", REBUILD)
#: Bodies of a file: one alone, those that touch united, or any number.
BODIES = ("one", "join", "all")
UNITS = ("mm", "cm", "m", "inch", "um", "micron")
#: Edges of a box shorter than this are no part, mm. A micrometre, below the detail of any printer.
_LEAST_EDGE = 1e-3


class _RepairOptions(Reader):
    """A table of plain values; texts that begin with a digit are lengths, in mm once read."""

    __slots__ = ()

    def read(self, value: object) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise Refused(f'found {shown(value)}; expected a table such as {{ edge = "2 mm" }}')
        return {key: self._plain(key, entry) for key, entry in value.items()}

    def _plain(self, key: str, value: object) -> object:
        if isinstance(value, str):
            if value[:1].isdigit():
                try:
                    return Quantity("length", above=0.0).read(value)
                except Refused as error:
                    raise Refused(f"{key}: {error}") from None
            return Text("a word", 80).read(value)
        if isinstance(value, bool | int):
            return value
        if not isinstance(value, float) or not isfinite(value):
            raise Refused(
                f"{key}: found {shown(value)}; expected a number, a length in quotes with its "
                f"unit, a word, true or false"
            )
        return value

    def json_schema(self) -> JsonSchema:
        value = {"type": ["number", "string", "boolean"]}
        return {"type": "object", "additionalProperties": value, "examples": [{"edge": "2 mm"}]}


def part_file(value: object, info: ValidationInfo) -> Path:
    """Path of a file of a surface that a case names, from the folder of the case on.

    Raises Refused or ValueError if it is no text, or no such file is allowed.
    """
    return resolve_part_file(_named(value, 'a file name such as "bracket.stl"'), **_allowed(info))


def data_file(
    value: object, info: ValidationInfo, example: str, suffixes: tuple[str, ...] | None = None
) -> Path:
    """Path of a file of data that a case names; of any suffix without ``suffixes``.

    Raises Refused or ValueError if it is no text, or no such file is allowed.
    """
    text = _named(value, f'a file name such as "{example}"')
    suffixes = suffixes or (PurePosixPath(text).suffix.lower(),)
    return resolve_data_file(text, suffixes=suffixes, **_allowed(info))


def data_folder(value: object, info: ValidationInfo, example: str) -> Path:
    """Path of a folder of data that a case names; refused as `data_file` is."""
    return resolve_data_folder(_named(value, f'a folder such as "{example}"'), **_allowed(info))


def _named(value: object, expected: str) -> str:
    if not isinstance(value, str):
        raise Refused(f"found {shown(value)}; expected {expected}")
    return value


def _allowed(info: ValidationInfo) -> dict[str, Any]:
    """Where relative paths start, and whether files may lie elsewhere."""
    context = info.context or {}
    return {
        "folder": context.get("folder", Path.cwd()),
        "allow_outside": bool(context.get("allow_outside", False)),
    }


class PartSpec(Table):
    """The solid part: exactly one of ``file`` and ``box``."""

    file: FilePath | None = Field(default=None, examples=["bracket.stl"])
    """File of the part, below the folder of the case; its absolute path once read."""
    box: Annotated[Triple, Vector("length", '["60 mm", "20 mm", "20 mm"]', 0.0)] | None = None
    """Edge lengths in mm; the box occupies [0, a] x [0, b] x [0, c]."""
    units: Annotated[str, Choice(UNITS)] | None = None
    """Unit of the coordinates of the file; may be left out where its format carries one."""
    chord_tolerance: Size | None = Field(default=None, examples=["0.05 mm"])
    """Largest distance of the triangles from the curved faces of a CAD file, mm."""
    repair: Annotated[str, Text("a way of repair", 80)] = "safe"
    """How far a damaged surface may be repaired: ``safe``, ``auto``, ``rebuild`` or a plugin's."""
    repair_options: Annotated[dict[str, Any], _RepairOptions()] = Field(default_factory=dict)
    """Options of ``rebuild`` or the plugin's repairer by name; lengths with their unit."""
    bodies: Annotated[str, Choice(BODIES)] = "one"
    """Bodies that are accepted: ``one``, several that touch and are united (``join``), or any
    (``all``)."""
    mesh_size: Size | None = Field(default=None, examples=["12 mm"])
    """Edge length of the tetrahedra of the solid, mm; by default it follows from the part's
    thickness, its cells and the number of unknowns."""
    mesher: Annotated[str, Text("the name of a mesher", 80, "pytetwild")] | None = None
    """Mesher of the solid: by default tetrahedra cut from bricks for a box, ``pytetwild`` for a
    file."""

    @property
    def element_size(self) -> float:
        """`mesh_size` as stated or, once the part is read, as it follows from that, mm.

        Raises `CaseError` before the part is read, where the case states none.
        """
        if self.mesh_size is None:
            raise CaseError("part.mesh_size is neither stated nor derived from the part yet")
        return self.mesh_size

    def brought(self) -> dict[str, Table]:
        """Tables of plugins' readers that the case states, by their key."""
        more = type(self).model_fields.keys() - PartSpec.model_fields.keys()
        return {key: table for key in sorted(more) if (table := getattr(self, key)) is not None}

    @property
    def bricks(self) -> Triple | None:
        """Edges of a box that is meshed in bricks; None where a mesher is asked."""
        return self.box if self.mesher is None else None

    @field_validator("file", mode="before")
    @classmethod
    def _find_file(cls, value: Any, info: ValidationInfo) -> Path:
        return part_file(value, info)

    @field_validator("box", mode="after")
    @classmethod
    def _no_speck(cls, value: Triple | None) -> Triple | None:
        for i, edge in enumerate(value or ()):
            if edge < _LEAST_EDGE:
                raise Refused(
                    f"entry {i + 1}: found {edge:g} mm; expected at least {_LEAST_EDGE:g} mm; is "
                    f"its unit right?"
                )
        return value

    @model_validator(mode="after")
    def _one_source(self) -> PartSpec:
        if (self.file is None) == (self.box is None):
            count = "neither" if self.file is None else "both"
            raise Refused(
                f'found {count} of file and box; expected exactly one: file = "part.stl" or '
                'box = ["60 mm", "20 mm", "20 mm"]'
            )
        if self.file is None and self.units is not None:
            raise key_error("units", "has no meaning with box, whose edges carry their units")
        for key in self.brought() if self.file is None else ():
            raise key_error(key, "has no meaning with box, which is read from no file")
        if self.file is None and self.chord_tolerance is not None:
            raise key_error("chord_tolerance", "has no meaning with box, whose faces are flat")
        return self
