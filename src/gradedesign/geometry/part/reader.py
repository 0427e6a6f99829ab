"""The record of a part reader: one file format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gradedesign.geometry.part.raw_triangles import RawTriangles
from gradedesign.geometry.part.voxel_volume import VoxelVolume


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
    sampled : bool
        Whether the format holds voxels. Then it is ``read(path, memory_limit_bytes)`` and returns
        a `VoxelVolume`; ``[part.voxels]`` says what of it is solid.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., RawTriangles | VoxelVolume]
    exact: bool = False
    sampled: bool = False
