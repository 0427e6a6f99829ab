"""The record of a surface exporter: one file format for printing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gradedesign.mesh.surface_mesh import SurfaceMesh


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """Writes the printed surface in one file format.

    Attributes
    ----------
    name : str
        Lower case with dashes; what ``[output] formats`` names, such as ``stl``.
    suffix : str
        Lower-case file ending with its dot, such as ``.stl``.
    write : callable
        ``write(path, surface)`` writes a closed `SurfaceMesh` in mm.
    """

    name: str
    suffix: str
    write: Callable[[Path, SurfaceMesh], None]
