"""``[run]`` and ``[output]``: budgets, how far to go, and what to write."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from gradedesign.common.values.suggest import instead, shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.value_types import (
    Choice,
    Flag,
    JsonSchema,
    Number,
    Quantity,
    Reader,
    Refused,
    Size,
    Whole,
)

#: Formats of a case that states none.
_FORMATS = ("stl", "vtu", "report")
_SOLVER, _ANALYSIS, _MESHER = "multigrid", "finite-cells", "pytetwild"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_NAME_SCHEMA: JsonSchema = {
    "type": "string",
    "pattern": f"^{_NAME.pattern}$",
    "x-range": "a name of what is installed",
}


class _Memory(Reader):
    """An amount of memory to whole bytes."""

    __slots__ = ()

    def read(self, value: object) -> int:
        return int(Quantity("memory", at_least=1e8).read(value))

    def json_schema(self) -> JsonSchema:
        return Quantity("memory", at_least=1e8).json_schema()


class _Name(Reader):
    """Name of something installed; whether it is there is checked when it is needed."""

    __slots__ = ("_example",)

    def __init__(self, example: str) -> None:
        self._example = example

    def read(self, value: object) -> str:
        if not (isinstance(value, str) and _NAME.fullmatch(value)):
            dashed = value.lower().replace("_", "-") if isinstance(value, str) else ""
            near = f'did you mean "{dashed}"? ' if _NAME.fullmatch(dashed) else ""
            raise Refused(f'found {shown(value)}; {near}expected a name such as "{self._example}"')
        return value

    def json_schema(self) -> JsonSchema:
        return {**_NAME_SCHEMA, "examples": [self._example]}


class _Formats(Reader):
    """List of different format names; whether they exist is checked when needed."""

    __slots__ = ()

    def read(self, value: object) -> tuple[str, ...]:
        if not isinstance(value, list):
            named = [value] if isinstance(value, str) and _NAME.fullmatch(value) else _FORMATS
            raise Refused(f"found {shown(value)}; expected a list such as {json.dumps(named)}")
        for entry in value:
            if not (isinstance(entry, str) and _NAME.fullmatch(entry)):
                near = instead(entry if isinstance(entry, str) else "", _FORMATS)
                raise Refused(f"found {shown(entry)}; expected the name of a format; {near}")
        if len(set(value)) != len(value):
            raise Refused("found a format twice; expected each once")
        return tuple(value)

    def json_schema(self) -> JsonSchema:
        name = {**_NAME_SCHEMA, "examples": list(_FORMATS)}
        return {"type": "array", "items": name, "uniqueItems": True}


class RunSpec(Table):
    """Budgets and how far to go."""

    called: ClassVar[Mapping[str, str]] = {
        "rounds": "max_iterations",
        "max_rounds": "max_iterations",
        "ram": "memory",
        "time_limit": "time",
        "budget": "time",
    }

    memory: Annotated[int, _Memory()] = 8_000_000_000
    """Memory, bytes, that the mesher's process, a predicted mesh, and a density map with its grid
    may take; linear solvers are limited by what the machine has left."""
    time: Annotated[float, Quantity("time", at_least=1.0)] = 3600.0
    """Budget, seconds."""
    acceptance: Annotated[str, Choice(("auto", "whole", "submodels"))] = "auto"
    """Part of the printed surface that is meshed again for the verdict: ``whole``, the most
    stressed cells (``submodels``), or whichever the time allows (``auto``)."""
    max_iterations: Annotated[int, Whole(1, 100)] = 12
    """Iterations of the loop, each a sizing and an explicit analysis, at most: cases met their
    limits after one to eight, and ``time`` ends those that take long."""
    stop_after: Annotated[str, Choice(("verdict", "solid", "sizing", "lattice"))] = "verdict"
    """Last stage; before the verdict the status is partial. With a stated density that is the
    lattice."""
    analysis: Annotated[str, _Name(_ANALYSIS)] = _ANALYSIS
    """Explicit analysis of the lattice: ``finite-cells``, quadratic bricks that its surface cuts,
    or one that a plugin supplies."""
    mesher: Annotated[str, _Name(_MESHER)] = _MESHER
    """Mesher of the printed surface for the verdict: ``pytetwild``, or that of a plugin."""
    solver: Annotated[str, _Name(_SOLVER)] = _SOLVER
    """Linear solver of every analysis: ``multigrid``, ``direct``, ``scikit-fem`` as a reference for
    small parts, or one that a plugin supplies."""
    elements_per_wall: Annotated[float, Number(at_least=0.25, at_most=16.0)] | None = Field(
        default=None, examples=[2.0]
    )
    """Elements of the explicit grid across the thinnest wall: 0.7 of walls and 1.8 of struts by
    default, and up to 1.7 times as many where the solid needs fewer than 0.3 million unknowns."""
    submodel_count: Annotated[int, Whole(1, 64)] = 2
    """Submodels analysed for acceptance."""
    explicit_mesh_size: Size | None = Field(default=None, examples=["0.3 mm"])
    """Grid spacing of the explicit mesh in mm, instead of ``elements_per_wall``."""
    price: Annotated[bool, Flag()] = True
    """Whether the verdict states what other bodies would weigh at the same limits: each is sized
    once, and sizings that the cache holds are not repeated."""

    @property
    def states_resolution(self) -> bool:
        """Whether it says how fine the explicit grid is."""
        return self.elements_per_wall is not None or self.explicit_mesh_size is not None


class OutputSpec(Table):
    """Files to write; pictures always are."""

    formats: Annotated[tuple[str, ...], _Formats()] = _FORMATS
    """Files to write: vtu, report, and what the installed exporters write."""
