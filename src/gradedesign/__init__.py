"""gradedesign: the lightest printable lattice version of a part that still meets its limits."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gradedesign.workspace.processor import settle_threads

if TYPE_CHECKING:
    from gradedesign.case.limits_schema import (
        Allowed,
        LimitEntry,
        SolidMultiple,
        as_multiple,
        in_number,
        stated_words,
    )
    from gradedesign.case.part_path import IMAGES, slices_with
    from gradedesign.cell.family import CellFamily
    from gradedesign.cell.maker import CellMaker
    from gradedesign.cell.strut_axes import StrutAxes
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
    from gradedesign.fe.eigen_solver import EigenProblem, EigenSolver, ExtremeValue
    from gradedesign.fe.linear_solver import LinearAnswer, LinearSolver, LinearSystem
    from gradedesign.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
    from gradedesign.lattice.beams import BeamLattice
    from gradedesign.lattice.dense_lattice import DenseLattice, PixelField, PixelPlane
    from gradedesign.lattice.sample import checked_values
    from gradedesign.limits.analysis import Analysis
    from gradedesign.limits.key import LimitKey
    from gradedesign.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
    from gradedesign.limits.row import LimitRow
    from gradedesign.limits.state import HomogenisedState, Predicted, Response
    from gradedesign.material.cubic_law import cubic_law, cubic_table_law
    from gradedesign.material.material import Material
    from gradedesign.material.power_law import power_law
    from gradedesign.material.property_table import PropertyTable, read_property_table
    from gradedesign.material.scaling_law import LawOrigin, ScalingLaw
    from gradedesign.material.shipped_tables import shipped_laws
    from gradedesign.material.tabulated_law import tabulated_law
    from gradedesign.mesh.distance_grid import DistanceBricks, distance_bricks, distance_grid
    from gradedesign.mesh.mesher import Mesher, serve_mesher
    from gradedesign.mesh.surface_mesh import SurfaceMesh
    from gradedesign.output.analysed_model import AnalysedModel, ModelStep
    from gradedesign.output.exporter import Exporter, PlannedPrint
    from gradedesign.output.output import FieldSet, FinishedRun, Output
    from gradedesign.output.printed_lattice import PrintedLattice, SampledPrint
    from gradedesign.part.exact_surface import ExactSurface
    from gradedesign.part.file_body import FileBody
    from gradedesign.part.file_faces import FileFaces
    from gradedesign.part.image_stack import read_images
    from gradedesign.part.npy_file import read_npy, read_npy_stream
    from gradedesign.part.raw_triangles import UNIT_MM, RawTriangles, raw_triangles
    from gradedesign.part.reader import PartReader
    from gradedesign.part.repairer import Repairer, serve_repairer
    from gradedesign.part.voxel_volume import BYTES_PER_VOXEL, VoxelVolume
    from gradedesign.pipeline import run
    from gradedesign.plugin.command import Command
    from gradedesign.plugin.markers import hookimpl
    from gradedesign.plugin.read_case import load_case
    from gradedesign.verify.analysis import (
        AnalysisEstimate,
        Discretisation,
        ExplicitAnalysis,
        PlannedSolid,
        Resolution,
        SolvedSolid,
        StressSample,
        SurfaceFields,
        VolumeFields,
    )
    from gradedesign.verify.printed_solid import PrintedSolid
    from gradedesign.workspace.progress import report_step
    from gradedesign.workspace.threads import in_threads

__all__ = [
    "BYTES_PER_VOXEL",
    "IMAGES",
    "UNIT_MM",
    "Allowed",
    "AnalysedModel",
    "Analysis",
    "AnalysisEstimate",
    "AnisotropicStiffness",
    "BeamLattice",
    "CaseError",
    "CellFamily",
    "CellMaker",
    "Command",
    "DenseLattice",
    "DensityError",
    "Discretisation",
    "DistanceBricks",
    "EigenProblem",
    "EigenSolver",
    "ExactSurface",
    "ExplicitAnalysis",
    "Exporter",
    "ExtremeValue",
    "FieldSet",
    "FileBody",
    "FileFaces",
    "FinishedRun",
    "GradeDesignError",
    "HomogenisedState",
    "IsotropicStiffness",
    "LatticeError",
    "LawOrigin",
    "Limit",
    "LimitEntry",
    "LimitKey",
    "LimitKind",
    "LimitRow",
    "LinearAnswer",
    "LinearSolver",
    "LinearSystem",
    "Material",
    "MeshError",
    "Mesher",
    "ModelStep",
    "Output",
    "PartError",
    "PartReader",
    "PixelField",
    "PixelPlane",
    "PlacedModel",
    "PlannedPrint",
    "PlannedSolid",
    "PluginError",
    "Predicted",
    "PrintedLattice",
    "PrintedSolid",
    "PropertyTable",
    "RawTriangles",
    "Repairer",
    "Resolution",
    "ResourceError",
    "Response",
    "SampledPrint",
    "ScalingLaw",
    "SolidMultiple",
    "SolvedSolid",
    "SolverError",
    "StatedLimit",
    "StressSample",
    "StrutAxes",
    "SurfaceFields",
    "SurfaceMesh",
    "VolumeFields",
    "VoxelVolume",
    "as_multiple",
    "checked_values",
    "cubic_law",
    "cubic_table_law",
    "distance_bricks",
    "distance_grid",
    "hookimpl",
    "in_number",
    "in_threads",
    "load_case",
    "power_law",
    "raw_triangles",
    "read_images",
    "read_npy",
    "read_npy_stream",
    "read_property_table",
    "report_step",
    "run",
    "serve_mesher",
    "serve_repairer",
    "shipped_laws",
    "slices_with",
    "stated_words",
    "tabulated_law",
]

#: Where the public names live; they are imported when first asked for, so that a command or a
#: plugin loads what it uses and no more.
_HOMES = {
    "plugin.read_case": "load_case",
    "case.limits_schema": "Allowed LimitEntry SolidMultiple as_multiple in_number stated_words",
    "lattice.beams": "BeamLattice",
    "lattice.dense_lattice": "DenseLattice PixelField PixelPlane",
    "lattice.sample": "checked_values",
    "limits.analysis": "Analysis",
    "limits.key": "LimitKey",
    "limits.limit": "Limit LimitKind PlacedModel StatedLimit",
    "limits.row": "LimitRow",
    "limits.state": "HomogenisedState Predicted Response",
    "case.part_path": "IMAGES slices_with",
    "cell.family": "CellFamily",
    "cell.maker": "CellMaker",
    "cell.strut_axes": "StrutAxes",
    "errors": "CaseError DensityError GradeDesignError LatticeError MeshError PartError "
    "PluginError ResourceError SolverError",
    "fe.eigen_solver": "EigenProblem EigenSolver ExtremeValue",
    "fe.linear_solver": "LinearAnswer LinearSolver LinearSystem",
    "fe.stiffness": "AnisotropicStiffness IsotropicStiffness",
    "material.cubic_law": "cubic_law cubic_table_law",
    "material.material": "Material",
    "material.power_law": "power_law",
    "material.property_table": "PropertyTable read_property_table",
    "material.scaling_law": "LawOrigin ScalingLaw",
    "material.shipped_tables": "shipped_laws",
    "material.tabulated_law": "tabulated_law",
    "mesh.distance_grid": "DistanceBricks distance_bricks distance_grid",
    "mesh.mesher": "Mesher serve_mesher",
    "mesh.surface_mesh": "SurfaceMesh",
    "output.analysed_model": "AnalysedModel ModelStep",
    "output.exporter": "Exporter PlannedPrint",
    "output.output": "FieldSet FinishedRun Output",
    "output.printed_lattice": "PrintedLattice SampledPrint",
    "part.exact_surface": "ExactSurface",
    "part.file_body": "FileBody",
    "part.file_faces": "FileFaces",
    "part.image_stack": "read_images",
    "part.npy_file": "read_npy read_npy_stream",
    "part.raw_triangles": "RawTriangles UNIT_MM raw_triangles",
    "part.reader": "PartReader",
    "part.voxel_volume": "BYTES_PER_VOXEL VoxelVolume",
    "part.repairer": "Repairer serve_repairer",
    "pipeline": "run",
    "plugin.command": "Command",
    "plugin.markers": "hookimpl",
    "verify.analysis": "AnalysisEstimate Discretisation ExplicitAnalysis PlannedSolid Resolution "
    "SolvedSolid StressSample SurfaceFields VolumeFields",
    "verify.printed_solid": "PrintedSolid",
    "workspace.progress": "report_step",
    "workspace.threads": "in_threads",
}
# Before anything imports numba, which reads its settings once.
settle_threads()
_MODULES = {name: module for module, names in _HOMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, whether they were asked for yet or not."""
    return list(__all__)
