"""The part's own triangles in the printed file, where ``[print] outer`` keeps them."""

from __future__ import annotations

from typing import Any

from gradedesign.design.case.schema import Case
from gradedesign.geometry.formats.read_stl import binary_records
from gradedesign.geometry.formats.write_stl import same_triangles
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, corner_points


def keeps_outer(case: Case) -> bool:
    """Whether the part's triangles stay as they are in the printed surface."""
    return case.print is not None and case.print.outer == "cad"


def outer_records(case: Case, part: SurfaceMesh) -> bytes:
    """Triangles of the part as its binary STL file in mm holds them, 50 bytes each.

    Empty where they are not kept, and where the file is another one or was mended: the part's
    surface then has their values.
    """
    if not keeps_outer(case) or case.part.file is None:
        return b""
    records = binary_records(case.part.file.read_bytes())
    return records if same_triangles(records, corner_points(part)) else b""


def outer_data(case: Case, part: SurfaceMesh) -> dict[str, Any]:
    """Plain data on the triangles that are kept; empty where none are."""
    if not keeps_outer(case):
        return {}
    exactness = "bytes" if outer_records(case, part) else "values"
    return {"outer": {"triangles": len(part.faces), "kept": exactness}}
