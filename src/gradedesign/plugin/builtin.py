"""The built-in records, registered through the same hooks as a plugin's."""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign.limits.kinds import builtin_kinds
from gradedesign.limits.limit import LimitKind
from gradedesign.material.library import builtin_materials
from gradedesign.material.material import Material
from gradedesign.output.exporter import Exporter
from gradedesign.output.stl import export_stl
from gradedesign.part.reader import PartReader
from gradedesign.part.stl import read_stl
from gradedesign.plugin.hookspecs import hookimpl


@hookimpl
def gradedesign_materials() -> Iterable[Material]:
    """Register the material library."""
    return builtin_materials()


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the STL reader."""
    yield PartReader(name="stl", suffixes=(".stl",), read=read_stl)


@hookimpl
def gradedesign_exporters() -> Iterable[Exporter]:
    """Register the STL exporter."""
    yield Exporter(name="stl", suffix=".stl", write=export_stl)


@hookimpl
def gradedesign_limits() -> Iterable[LimitKind]:
    """Register the kinds of limits of the core."""
    return builtin_kinds()
