"""gradedesign: the lightest printable lattice version of a part that still meets its limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gradedesign.case.limits_schema import (
    Allowed,
    LimitEntry,
    SolidMultiple,
    as_multiple,
    in_number,
    stated_words,
)
from gradedesign.cell.family import CellFamily
from gradedesign.cell.maker import CellMaker
from gradedesign.errors import (
    CaseError,
    DensityError,
    GradeDesignError,
    LatticeError,
    MeshError,
    PartError,
    PluginError,
    ResourceError,
    SolverError,
)
from gradedesign.limits.analysis import Analysis
from gradedesign.limits.key import LimitKey
from gradedesign.limits.limit import Limit, LimitKind, PlacedCase, StatedLimit
from gradedesign.limits.row import LimitRow
from gradedesign.limits.state import HomogenisedState, Predicted, Response
from gradedesign.material.cubic_law import cubic_law, cubic_table_law
from gradedesign.material.finite_size_table import FiniteSizeTable, read_finite_size_table
from gradedesign.material.material import Material
from gradedesign.material.power_law import power_law
from gradedesign.material.property_table import PropertyTable, read_property_table
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.material.shipped_tables import shipped_finite_size_tables, shipped_laws
from gradedesign.material.tabulated_law import tabulated_law
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.output.exporter import Exporter
from gradedesign.output.printed_lattice import PrintedLattice
from gradedesign.part.raw_triangles import RawTriangles, raw_triangles
from gradedesign.part.reader import PartReader
from gradedesign.plugin.hookspecs import hookimpl

if TYPE_CHECKING:
    from gradedesign.pipeline import run
    from gradedesign.plugin.read_case import load_case

__all__ = [
    "Allowed",
    "Analysis",
    "CaseError",
    "CellFamily",
    "CellMaker",
    "DensityError",
    "Exporter",
    "FiniteSizeTable",
    "GradeDesignError",
    "HomogenisedState",
    "LatticeError",
    "Limit",
    "LimitEntry",
    "LimitKey",
    "LimitKind",
    "LimitRow",
    "Material",
    "MeshError",
    "PartError",
    "PartReader",
    "PlacedCase",
    "PluginError",
    "Predicted",
    "PrintedLattice",
    "PropertyTable",
    "RawTriangles",
    "ResourceError",
    "Response",
    "ScalingLaw",
    "SolidMultiple",
    "SolverError",
    "StatedLimit",
    "SurfaceMesh",
    "as_multiple",
    "cubic_law",
    "cubic_table_law",
    "hookimpl",
    "in_number",
    "load_case",
    "power_law",
    "raw_triangles",
    "read_finite_size_table",
    "read_property_table",
    "run",
    "shipped_finite_size_tables",
    "shipped_laws",
    "stated_words",
    "tabulated_law",
]


def __getattr__(name: str) -> Any:
    """Import what runs a case when it is first asked for: plugins need none of it."""
    if name == "load_case":
        from gradedesign.plugin.read_case import load_case

        return load_case
    if name == "run":
        from gradedesign.pipeline import run

        return run
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
