"""Solids of CadQuery and build123d as parts for gradedesign, with named faces as regions."""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign import PartReader, hookimpl
from gradedesign_cad.solid_file import read_solid
from gradedesign_cad.write_part import write_part

__all__ = ["gradedesign_readers", "write_part"]


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the reader of what `write_part` writes."""
    yield PartReader(name="solid", suffixes=(".solid",), read=read_solid)
