"""gradedesign: the lightest printable lattice version of a part that still meets its limits.

Above 300 lines: one list of the public names, with their homes.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gradedesign.common.system.processor import settle_threads
from gradedesign.common.values.shown_record import drawn_by

if TYPE_CHECKING:
    from gradedesign.common.system.progress import report_step
    from gradedesign.common.system.threads import in_ranges, in_threads
    from gradedesign.common.values.plugins_by_name import supplied_by
    from gradedesign.common.values.table import Table
    from gradedesign.common.values.value_types import Flag, Number, Quantity, Vector
    from gradedesign.design.printing.process import Process, Waviness
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
    from gradedesign.geometry.cell.family import CellFamily, StrutAxes
    from gradedesign.geometry.cell.maker import CellMaker
    from gradedesign.geometry.contour.sample import checked_values
    from gradedesign.geometry.formats.exporter import Exporter, FieldSet, PlannedPrint
    from gradedesign.geometry.formats.printed_lattice import PrintedLattice, SampledPrint
    from gradedesign.geometry.formats.read_back import require_read_back
    from gradedesign.geometry.formats.write_stl import float32_vertices
    from gradedesign.geometry.lattice.component import CellComponent, CutComponent, SolidComponent
    from gradedesign.geometry.lattice.component_kind import (
        ComponentEntry,
        ComponentKind,
        ComponentPlace,
    )
    from gradedesign.geometry.lattice.components.net_skin import NetSkin, depths_of
    from gradedesign.geometry.lattice.domain import DesignDomain
    from gradedesign.geometry.lattice.field_reader import DensityRequest, FieldReader
    from gradedesign.geometry.lattice.lattice import (
        LatticeDesign,
        cell_gradient,
        density_at,
        lattice_field,
    )
    from gradedesign.geometry.lattice.solid_layers import solid_layers
    from gradedesign.geometry.lattice.tet_density import tet_density, tet_tensors
    from gradedesign.geometry.lattice.trim import solid_surface
    from gradedesign.geometry.maps.cell_map import CellMap
    from gradedesign.geometry.part.cut_bodies import (
        Cutter,
        PlacedBody,
        closed_body,
        cut_together,
        meet,
        without_cutters,
    )
    from gradedesign.geometry.part.exact_surface import ExactSurface
    from gradedesign.geometry.part.file_faces import FileBody, FileFaces
    from gradedesign.geometry.part.part_path import IMAGES, natural, slices_with
    from gradedesign.geometry.part.raw_triangles import UNIT_MM, RawTriangles, raw_triangles
    from gradedesign.geometry.part.reader import FileRequest, PartReader
    from gradedesign.geometry.part.repairer import Repairer, serve_repairer
    from gradedesign.geometry.part.signed_distance import SurfaceDistance
    from gradedesign.geometry.tets.mesher import Mesher, serve_mesher
    from gradedesign.geometry.tets.tet_mesh import TetMesh, signed_volumes
    from gradedesign.geometry.triangles._closest_kernels import nearest_on_triangle
    from gradedesign.geometry.triangles.distance_grid import distance_grid
    from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
    from gradedesign.mechanics.explicit.analysis import (
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
    from gradedesign.mechanics.explicit.printed_solid import PrintedSolid
    from gradedesign.mechanics.fe.stiffness import AnisotropicStiffness, IsotropicStiffness
    from gradedesign.mechanics.limits.analysis import Analysis
    from gradedesign.mechanics.limits.key import LimitKey
    from gradedesign.mechanics.limits.limit import Limit, LimitKind, PlacedModel, StatedLimit
    from gradedesign.mechanics.limits.limits_schema import (
        Allowed,
        LimitEntry,
        SolidMultiple,
        as_multiple,
        in_number,
        stated_words,
    )
    from gradedesign.mechanics.limits.row import LimitRow
    from gradedesign.mechanics.limits.state import HomogenisedState, Predicted, Response
    from gradedesign.mechanics.material.cubic_law import cubic_law, cubic_table_law
    from gradedesign.mechanics.material.material import Material
    from gradedesign.mechanics.material.power_law import power_law
    from gradedesign.mechanics.material.property_table import PropertyTable, read_property_table
    from gradedesign.mechanics.material.scaling_law import LawOrigin, ScalingLaw
    from gradedesign.mechanics.material.shipped_tables import shipped_laws
    from gradedesign.mechanics.material.tabulated_law import tabulated_law
    from gradedesign.mechanics.solver.eigen_solver import EigenProblem, EigenSolver, ExtremeValue
    from gradedesign.mechanics.solver.linear_solver import LinearAnswer, LinearSolver, LinearSystem
    from gradedesign.pipeline import run
    from gradedesign.program.host.command import Command
    from gradedesign.program.host.completion import completed
    from gradedesign.program.host.markers import hookimpl
    from gradedesign.program.host.read_case import load_case, load_part
    from gradedesign.program.outputs.analysed_model import AnalysedModel, ModelStep
    from gradedesign.program.outputs.output import FinishedRun, Output
    from gradedesign.program.outputs.report_section import ReportSection, ReportTable

__all__ = [
    "IMAGES", "UNIT_MM", "Allowed", "AnalysedModel", "Analysis", "AnalysisEstimate",
    "AnisotropicStiffness", "CaseError", "CellComponent", "CellFamily", "CellMaker", "CellMap",
    "Command", "ComponentEntry", "ComponentKind", "ComponentPlace", "CutComponent", "Cutter",
    "DensityError", "DensityRequest", "DesignDomain", "Discretisation", "EigenProblem",
    "EigenSolver", "ExactSurface", "ExplicitAnalysis", "Exporter", "ExtremeValue", "FieldReader",
    "FieldSet", "FileBody", "FileFaces", "FileRequest", "FinishedRun", "Flag", "GradeDesignError",
    "HomogenisedState", "IsotropicStiffness", "LatticeDesign", "LatticeError", "LawOrigin", "Limit",
    "LimitEntry", "LimitKey", "LimitKind", "LimitRow", "LinearAnswer", "LinearSolver",
    "LinearSystem", "Material", "MeshError", "Mesher", "ModelStep", "NetSkin", "Number", "Output",
    "PartError", "PartReader", "PlacedBody", "PlacedModel", "PlannedPrint", "PlannedSolid",
    "PluginError", "Predicted", "PrintedLattice", "PrintedSolid", "Process", "PropertyTable",
    "Quantity", "RawTriangles", "Repairer", "ReportSection", "ReportTable", "Resolution",
    "ResourceError", "Response", "SampledPrint", "ScalingLaw", "SolidComponent", "SolidMultiple",
    "SolvedSolid", "SolverError", "StatedLimit", "StressSample", "StrutAxes", "SurfaceDistance",
    "SurfaceFields", "SurfaceMesh", "Table", "TetMesh", "Vector", "VolumeFields", "Waviness",
    "as_multiple", "cell_gradient", "checked_values", "closed_body", "completed", "cubic_law",
    "cubic_table_law", "cut_together", "density_at", "depths_of", "distance_grid",
    "float32_vertices", "hookimpl", "in_number", "in_ranges", "in_threads", "lattice_field",
    "load_case", "load_part", "meet", "natural", "nearest_on_triangle", "power_law",
    "raw_triangles", "read_property_table", "report_step", "require_read_back", "run",
    "serve_mesher", "serve_repairer", "shipped_laws", "signed_volumes", "slices_with",
    "solid_layers", "solid_surface", "stated_words", "supplied_by", "tabulated_law", "tet_density",
    "tet_tensors", "without_cutters",
]  # fmt: skip

#: Where the public names live; they are imported when first asked for, so that a command or a
#: plugin loads what it uses and no more.
_HOMES = {
    "program.host.read_case": "load_case load_part",
    "mechanics.limits.limits_schema": "Allowed LimitEntry SolidMultiple as_multiple in_number "
    "stated_words",
    "geometry.lattice.component": "CellComponent CutComponent SolidComponent",
    "geometry.lattice.component_kind": "ComponentEntry ComponentKind ComponentPlace",
    "geometry.lattice.components.net_skin": "NetSkin depths_of",
    "geometry.lattice.domain": "DesignDomain",
    "geometry.lattice.lattice": "LatticeDesign cell_gradient density_at lattice_field",
    "geometry.lattice.field_reader": "DensityRequest FieldReader",
    "geometry.lattice.tet_density": "tet_density tet_tensors",
    "geometry.lattice.trim": "solid_surface",
    "geometry.part.cut_bodies": "Cutter PlacedBody closed_body cut_together meet without_cutters",
    "geometry.lattice.solid_layers": "solid_layers",
    "geometry.contour.sample": "checked_values",
    "mechanics.limits.analysis": "Analysis",
    "mechanics.limits.key": "LimitKey",
    "mechanics.limits.limit": "Limit LimitKind PlacedModel StatedLimit",
    "mechanics.limits.row": "LimitRow",
    "mechanics.limits.state": "HomogenisedState Predicted Response",
    "geometry.part.part_path": "IMAGES natural slices_with",
    "geometry.maps.cell_map": "CellMap",
    "geometry.cell.family": "CellFamily StrutAxes",
    "geometry.cell.maker": "CellMaker",
    "errors": "CaseError DensityError GradeDesignError LatticeError MeshError PartError "
    "PluginError ResourceError SolverError",
    "design.printing.process": "Process Waviness",
    "mechanics.solver.eigen_solver": "EigenProblem EigenSolver ExtremeValue",
    "mechanics.solver.linear_solver": "LinearAnswer LinearSolver LinearSystem",
    "mechanics.fe.stiffness": "AnisotropicStiffness IsotropicStiffness",
    "mechanics.material.cubic_law": "cubic_law cubic_table_law",
    "mechanics.material.material": "Material",
    "mechanics.material.power_law": "power_law",
    "mechanics.material.property_table": "PropertyTable read_property_table",
    "mechanics.material.scaling_law": "LawOrigin ScalingLaw",
    "mechanics.material.shipped_tables": "shipped_laws",
    "mechanics.material.tabulated_law": "tabulated_law",
    "geometry.triangles._closest_kernels": "nearest_on_triangle",
    "geometry.triangles.distance_grid": "distance_grid",
    "geometry.tets.mesher": "Mesher serve_mesher",
    "geometry.tets.tet_mesh": "TetMesh signed_volumes",
    "geometry.triangles.surface_mesh": "SurfaceMesh",
    "program.outputs.analysed_model": "AnalysedModel ModelStep",
    "geometry.formats.exporter": "Exporter FieldSet PlannedPrint",
    "program.outputs.output": "FinishedRun Output",
    "program.outputs.report_section": "ReportSection ReportTable",
    "geometry.formats.read_back": "require_read_back",
    "geometry.formats.write_stl": "float32_vertices",
    "geometry.formats.printed_lattice": "PrintedLattice SampledPrint",
    "geometry.part.exact_surface": "ExactSurface",
    "geometry.part.file_faces": "FileBody FileFaces",
    "geometry.part.raw_triangles": "RawTriangles UNIT_MM raw_triangles",
    "geometry.part.reader": "FileRequest PartReader",
    "geometry.part.signed_distance": "SurfaceDistance",
    "common.values.plugins_by_name": "supplied_by",
    "common.values.table": "Table",
    "common.values.value_types": "Flag Number Quantity Vector",
    "geometry.part.repairer": "Repairer serve_repairer",
    "pipeline": "run",
    "program.host.command": "Command",
    "program.host.completion": "completed",
    "program.host.markers": "hookimpl",
    "mechanics.explicit.analysis": "AnalysisEstimate Discretisation ExplicitAnalysis "
    "PlannedSolid Resolution SolvedSolid StressSample SurfaceFields VolumeFields",
    "mechanics.explicit.printed_solid": "PrintedSolid",
    "common.system.progress": "report_step",
    "common.system.threads": "in_ranges in_threads",
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


def _drawn(record: object) -> str | None:
    """A record as a notebook shows it; drawing loads the program's rooms, so only when asked."""
    from gradedesign.program.commands.notebook import notebook_html

    return notebook_html(record)


drawn_by(_drawn)


def __dir__() -> list[str]:
    """Public names, whether they were asked for yet or not."""
    return list(__all__)
