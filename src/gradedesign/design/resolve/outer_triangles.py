"""The part's own triangles in the printed file, where ``[print] outer`` keeps them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gradedesign.design.printing.print_schema import PrintSpec
from gradedesign.geometry.formats.read_stl import binary_records
from gradedesign.geometry.formats.write_stl import same_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points


def keeps_outer(spec: PrintSpec | None) -> bool:
    """Whether the part's triangles stay as they are in the printed surface."""
    return spec is not None and spec.outer == "cad"


def outer_records(spec: PrintSpec | None, file: Path | None, part: SurfaceMesh) -> bytes:
    """Triangles of the part as its binary STL file in mm holds them, 50 bytes each.

    Empty where they are not kept, and where the file is another one or was mended: the part's
    surface then has their values.
    """
    if not keeps_outer(spec) or file is None:
        return b""
    records = binary_records(file.read_bytes())
    return records if same_triangles(records, corner_points(part)) else b""


def outer_data(spec: PrintSpec | None, file: Path | None, part: SurfaceMesh) -> dict[str, Any]:
    """Plain data on the triangles that are kept; empty where none are."""
    if not keeps_outer(spec):
        return {}
    exactness = "bytes" if outer_records(spec, file, part) else "values"
    return {"outer": {"triangles": len(part.faces), "kept": exactness}}
