"""The built-in records, registered through the same hooks as a plugin's."""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign.part.reader import PartReader
from gradedesign.part.stl import read_stl
from gradedesign.plugin.hookspecs import hookimpl


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the STL reader."""
    yield PartReader(name="stl", suffixes=(".stl",), read=read_stl)
