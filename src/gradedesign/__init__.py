"""gradedesign: the lightest printable lattice version of a part that still meets its limits."""

from __future__ import annotations

from gradedesign.cell.family import CellFamily
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
from gradedesign.material.cubic_law import cubic_law, cubic_table_law
from gradedesign.material.material import Material
from gradedesign.material.power_law import power_law
from gradedesign.material.scaling_law import ScalingLaw
from gradedesign.mesh.surface_mesh import SurfaceMesh
from gradedesign.output.exporter import Exporter
from gradedesign.part.raw_triangles import RawTriangles
from gradedesign.part.reader import PartReader
from gradedesign.plugin.hookspecs import hookimpl

__all__ = [
    "CaseError",
    "CellFamily",
    "DensityError",
    "Exporter",
    "GradeDesignError",
    "LatticeError",
    "Material",
    "MeshError",
    "PartError",
    "PartReader",
    "PluginError",
    "RawTriangles",
    "ResourceError",
    "ScalingLaw",
    "SolverError",
    "SurfaceMesh",
    "cubic_law",
    "cubic_table_law",
    "hookimpl",
    "power_law",
]
