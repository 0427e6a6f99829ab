"""Every hook takes no argument, has an example that runs, and something real uses it."""

import doctest
import inspect

import pytest

from gradedesign import (
    CellFamily,
    CellMaker,
    ComponentKind,
    EigenSolver,
    ExplicitAnalysis,
    Exporter,
    FieldReader,
    LimitKind,
    LinearSolver,
    Material,
    Mesher,
    Output,
    PartReader,
    Process,
    Repairer,
    ReportSection,
    ScalingLaw,
)
from gradedesign.program.host import hookspecs
from gradedesign.program.host.registry import build_registry

HOOKS = {
    "gradedesign_cell_families": CellFamily,
    "gradedesign_cell_makers": CellMaker,
    "gradedesign_scaling_laws": ScalingLaw,
    "gradedesign_materials": Material,
    "gradedesign_processes": Process,
    "gradedesign_meshers": Mesher,
    "gradedesign_readers": PartReader,
    "gradedesign_field_readers": FieldReader,
    "gradedesign_repairers": Repairer,
    "gradedesign_exporters": Exporter,
    "gradedesign_outputs": Output,
    "gradedesign_report_sections": ReportSection,
    "gradedesign_limits": LimitKind,
    "gradedesign_components": ComponentKind,
    "gradedesign_analyses": ExplicitAnalysis,
    "gradedesign_solvers": LinearSolver,
    "gradedesign_eigen_solvers": EigenSolver,
}


def test_every_hook_is_tested_here():
    # Commands are no part of the registry; test_commands.py registers one.
    found = {name for name in vars(hookspecs) if name.startswith("gradedesign_")}
    assert set(HOOKS) == found - {"gradedesign_commands"}


@pytest.mark.parametrize("hook", HOOKS)
def test_hook_takes_nothing_and_shows_an_example(hook):
    specification = getattr(hookspecs, hook)
    assert not inspect.signature(specification).parameters
    assert list(specification()) == []
    assert f"def {hook}" in specification.__doc__


def test_examples_run():
    result = doctest.testmod(hookspecs)
    assert result.attempted >= 3 * len(HOOKS)
    assert result.failed == 0


@pytest.mark.parametrize(("hook", "record"), HOOKS.items())
def test_something_real_is_registered_by_every_hook(hook, record):
    # The distributions of this repository are installed beside the core.
    shelf = getattr(build_registry(), hook.removeprefix("gradedesign_"))
    assert shelf
    assert all(isinstance(value, record) for value in shelf.values())
