"""The record of a part reader: one file format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gradedesign.common.values.table import Table
from gradedesign.geometry.part.raw_triangles import RawTriangles


@dataclass(frozen=True, slots=True, kw_only=True)
class FileRequest:
    """Values of a case for a reader that brings a table of ``[part]``.

    Attributes
    ----------
    table : instance of `PartReader.table`, or None
        As the case states it; None where it states none.
    units : str or None
        ``[part] units``.
    memory_limit_bytes : int
        Bytes that reading may take.
    """

    table: Any
    units: str | None
    memory_limit_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PartReader:
    """Reads parts from one file format.

    Attributes
    ----------
    name : str
        Lower case with dashes, such as ``stl``.
    suffixes : tuple of str
        Lower-case file endings with their dot, such as ``(".stl",)``.
    read : callable
        ``read(path)`` returns `RawTriangles`: corners in the file's unit, the unit where the
        format carries one, and faces, names and colours where it has them. It raises
        `gradedesign.PartError` for a file it does not understand.
    exact : bool
        Whether the format has curved faces, which are triangulated on reading. Then it is
        ``read(path, chord_tolerance)``: the largest distance of a triangle from its face in mm, or
        None where the case leaves it to the reader.
    key : str
        Key of ``[part]`` that the reader brings, such as ``voxels``; readers of one distribution
        may share it. Then it is ``read(path, request)`` with a `FileRequest`, of files that only
        ``[part]`` names.
    table : type of Table, optional
        Layout of the table under that key.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., RawTriangles]
    exact: bool = False
    key: str = ""
    table: type[Table] | None = None
