"""The built-in records, registered through the same hooks as a plugin's."""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign.design.printing.process import Process
from gradedesign.design.printing.process_schema import builtin_processes
from gradedesign.geometry.cell.formula_cell import FORMULA_MAKER
from gradedesign.geometry.cell.maker import CellMaker
from gradedesign.geometry.formats.exporter import Exporter
from gradedesign.geometry.formats.read_stl import read_stl
from gradedesign.geometry.formats.write_stl import export_stl
from gradedesign.geometry.lattice.component_kind import ComponentKind, builtin_components
from gradedesign.geometry.part.reader import PartReader
from gradedesign.geometry.tets.mesher import PYTETWILD, Mesher
from gradedesign.mechanics.explicit.analysis import ExplicitAnalysis
from gradedesign.mechanics.explicit.finite_cells import FINITE_CELLS
from gradedesign.mechanics.fe.multigrid_solver import MULTIGRID
from gradedesign.mechanics.fe.scikit_fem import SCIKIT_FEM
from gradedesign.mechanics.limits.kinds import builtin_kinds
from gradedesign.mechanics.limits.limit import LimitKind
from gradedesign.mechanics.material.library import builtin_materials
from gradedesign.mechanics.material.material import Material
from gradedesign.mechanics.solver.direct import DIRECT
from gradedesign.mechanics.solver.linear_solver import LinearSolver
from gradedesign.program.host.hookspecs import hookimpl
from gradedesign.program.outputs.output import Output
from gradedesign.program.outputs.report import REPORT
from gradedesign.program.outputs.report_section import ReportSection
from gradedesign.program.outputs.sections import builtin_sections
from gradedesign.program.outputs.vtu_output import VTU


@hookimpl
def gradedesign_cell_makers() -> Iterable[CellMaker]:
    """Register the maker of cells that a case states as a formula."""
    yield FORMULA_MAKER


@hookimpl
def gradedesign_materials() -> Iterable[Material]:
    """Register the material library."""
    return builtin_materials()


@hookimpl
def gradedesign_processes() -> Iterable[Process]:
    """Register the published processes."""
    return builtin_processes()


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the reader of STL."""
    yield PartReader(name="stl", suffixes=(".stl",), read=read_stl)


@hookimpl
def gradedesign_meshers() -> Iterable[Mesher]:
    """Register pytetwild."""
    yield PYTETWILD


@hookimpl
def gradedesign_exporters() -> Iterable[Exporter]:
    """Register the exporter of STL."""
    yield Exporter(name="stl", suffix=".stl", write=export_stl)


@hookimpl
def gradedesign_outputs() -> Iterable[Output]:
    """Register fields as VTU, and the report."""
    return VTU, REPORT


@hookimpl
def gradedesign_report_sections() -> Iterable[ReportSection]:
    """Register what was used: law, material, zones, files and versions."""
    return builtin_sections()


@hookimpl
def gradedesign_solvers() -> Iterable[LinearSolver]:
    """Register the linear solvers."""
    return MULTIGRID, DIRECT, SCIKIT_FEM


@hookimpl
def gradedesign_limits() -> Iterable[LimitKind]:
    """Register the kinds of limits of the core."""
    return builtin_kinds()


@hookimpl
def gradedesign_components() -> Iterable[ComponentKind]:
    """Register the kinds of components of the core."""
    return builtin_components()


@hookimpl
def gradedesign_analyses() -> Iterable[ExplicitAnalysis]:
    """Register finite cells."""
    return (FINITE_CELLS,)
