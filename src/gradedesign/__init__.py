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
from gradedesign.material.material import Material
from gradedesign.material.scaling_law import ScalingLaw

__all__ = [
    "CaseError",
    "CellFamily",
    "DensityError",
    "GradeDesignError",
    "LatticeError",
    "Material",
    "MeshError",
    "PartError",
    "PluginError",
    "ResourceError",
    "ScalingLaw",
    "SolverError",
]
