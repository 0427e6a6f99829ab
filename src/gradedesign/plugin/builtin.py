"""The built-in records, registered through the same hooks as a plugin's."""

from __future__ import annotations

from collections.abc import Iterable

from gradedesign.fe.direct import DIRECT
from gradedesign.fe.linear_solver import LinearSolver
from gradedesign.fe.multigrid_solver import MULTIGRID
from gradedesign.fe.scikit_fem import SCIKIT_FEM
from gradedesign.material.library import builtin_materials
from gradedesign.material.material import Material
from gradedesign.output.exporter import Exporter
from gradedesign.output.stl import export_stl
from gradedesign.part.reader import PartReader
from gradedesign.part.stl import read_stl
from gradedesign.plugin.hookspecs import hookimpl


@hookimpl
def gradedesign_materials() -> Iterable[Material]:
    """Register the material library."""
    return builtin_materials()


@hookimpl
def gradedesign_readers() -> Iterable[PartReader]:
    """Register the STL reader."""
    yield PartReader(name="stl", suffixes=(".stl",), read=read_stl)


@hookimpl
def gradedesign_exporters() -> Iterable[Exporter]:
    """Register the STL exporter."""
    yield Exporter(name="stl", suffix=".stl", write=export_stl)


@hookimpl
def gradedesign_solvers() -> Iterable[LinearSolver]:
    """Register the linear solvers."""
    return MULTIGRID, DIRECT, SCIKIT_FEM
