"""``[run]`` and ``[output]``: budgets, how far to go, and what to write."""

from __future__ import annotations

from typing import Annotated

from gradedesign.case.suggest import instead, listed, shown
from gradedesign.case.table import Table
from gradedesign.case.value_types import (
    Choice,
    JsonSchema,
    Number,
    Quantity,
    Reader,
    Refused,
    Size,
    Whole,
)

_FORMATS = ("stl", "vtu", "report")
_PLANNED_FORMATS = ("3mf", "slices", "vtkhdf")


class _Memory(Reader):
    """An amount of memory to whole bytes."""

    __slots__ = ()

    def read(self, value: object) -> int:
        return int(Quantity("memory", at_least=1e8).read(value))

    def json_schema(self) -> JsonSchema:
        return Quantity("memory").json_schema()


class _Formats(Reader):
    """A list of different formats."""

    __slots__ = ()

    def read(self, value: object) -> tuple[str, ...]:
        if not isinstance(value, list):
            raise Refused(f"found {shown(value)}; expected a list of {listed(_FORMATS)}")
        for entry in value:
            word = entry if isinstance(entry, str) else ""
            if word in _PLANNED_FORMATS:
                raise Refused(f"found {shown(word)}, not there yet; {instead('', _FORMATS)}")
            if word not in _FORMATS:
                raise Refused(f"found {shown(entry)}; {instead(word, _FORMATS)}")
        if len(set(value)) != len(value):
            raise Refused("found a format twice; expected each once")
        return tuple(value)

    def json_schema(self) -> JsonSchema:
        return {"type": "array", "items": {"enum": list(_FORMATS)}, "uniqueItems": True}


class RunSpec(Table):
    """Budgets and how far to go."""

    memory: Annotated[int, _Memory()] = 8_000_000_000
    """Bytes that worker processes and predictions may take."""
    time: Annotated[float, Quantity("time", at_least=1.0)] = 3600.0
    """Budget in seconds."""
    acceptance: Annotated[str, Choice(("auto", "whole", "windows"))] = "auto"
    """Whether the whole lattice or its most stressed windows are meshed again for the verdict."""
    max_rounds: Annotated[int, Whole(1, 100)] = 6
    """Rounds of correction."""
    stop_after: Annotated[str, Choice(("verdict", "solid", "sizing", "lattice"))] = "verdict"
    """Last stage; before the verdict the status is partial."""
    mesh_cubes_per_wall: Annotated[float, Number(at_least=1.0, at_most=16.0)] = 1.25
    """Grid cubes of the explicit mesh across the thinnest wall."""
    window_count: Annotated[int, Whole(1, 64)] = 2
    """Windows analysed for acceptance."""
    explicit_mesh_size: Size | None = None
    """Cube edge of the explicit mesh in mm, instead of ``mesh_cubes_per_wall``."""


class OutputSpec(Table):
    """What is written; pictures always are."""

    formats: Annotated[tuple[str, ...], _Formats()] = _FORMATS
    """Files to write."""
