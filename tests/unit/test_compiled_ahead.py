"""Kernels that a process beside the first run compiles: when it starts and ends, and which."""

import subprocess
import sys

import numpy as np
import psutil
import pytest
from numba import njit
from numba.core import event

from gradedesign.common.system import compiling
from gradedesign.mechanics.fe.load_schema import LoadCaseSpec
from gradedesign.mechanics.finite_cell._operator_kernels import add_product
from gradedesign.mechanics.finite_cell._patch_kernels import add_patches
from gradedesign.mechanics.finite_cell._weight_kernels import fitted_weights
from gradedesign.mechanics.finite_cell.analysis import divide, solve_divided
from gradedesign.mechanics.finite_cell.cut_problem import CutProblem
from gradedesign.mechanics.material.material import Material
from gradedesign.program.commands import compiled_ahead
from gradedesign.program.commands.compiled_ahead import _end, compiling_ahead, rehearse


@pytest.fixture
def started(monkeypatch):
    """Processes that were started, each of which waits for its end instead of compiling."""
    processes = []

    def start(command, **options):
        assert command == [sys.executable, "-m", compiled_ahead.__name__]
        waiting = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        processes.append(waiting)
        return waiting

    monkeypatch.setattr(compiled_ahead, "Popen", start)
    monkeypatch.setattr(compiled_ahead, "usable_cores", lambda: 2)
    # A listener that has heard nothing yet: there is one start in a process.
    monkeypatch.setattr(compiling, "_COMPILATIONS", listener := compiling._Compilations())
    yield processes
    event.unregister("numba:compile", listener)


def compile_one():
    @njit
    def doubled(x):
        return 2.0 * x

    assert doubled(1.5) == 3.0


def test_one_process_is_started_by_the_first_compilation_and_ends_with_the_block(started):
    with compiling_ahead():
        assert started == []
        compile_one()
        compile_one()
        assert len(started) == 1
        assert psutil.pid_exists(started[0].pid)
    assert started[0].poll() is not None
    compile_one()
    with compiling_ahead():
        compile_one()
    assert len(started) == 1


def test_nothing_is_started_where_nothing_is_compiled_nor_for_one_core(started, monkeypatch):
    with compiling_ahead():
        pass
    assert started == []
    monkeypatch.setattr(compiled_ahead, "usable_cores", lambda: 1)
    with compiling_ahead():
        compile_one()
    assert started == []


def solved_block():
    """Work of a drilled block between two ends, under its weight and a temperature."""

    def drilled(points):
        x, _, z = points
        hole = 2.2 - np.hypot(x - 5.0, z - 4.0)
        return np.maximum(hole, np.maximum(np.abs(x - 6.0) - 6.0, np.abs(z - 4.0) - 4.0))

    hang = LoadCaseSpec.model_validate(
        {
            "name": "hang",
            "fix": [{"region": "x0"}],
            "acceleration": ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"],
            "temperature_change": "20 K",
        }
    )
    block = CutProblem(
        field=drilled, lower=np.zeros(3), upper=np.array([12.0, 8.0, 8.0]), cases=(hang,),
        regions={"x0": _end(0.0)},
        material=Material(
            name="hot", youngs_modulus=7e4, poissons_ratio=0.33, density=2.7e-9,
            yield_strength=200.0, thermal_expansion=2.3e-5,
        ),
    )  # fmt: skip
    return solve_divided(block, *divide(block, 0.9)).work["hang"]


@pytest.mark.slow
def test_the_process_compiles_what_an_analysis_takes():
    """Solving another solid after it gives the kernels no further signatures."""
    kernels = (add_product, add_patches, fitted_weights)
    rehearse()
    before = [set(kernel.signatures) for kernel in kernels]
    assert len(before[0]) == 2  # of the iteration, and of its preconditioner in single precision
    assert np.isfinite(solved_block())
    assert [set(kernel.signatures) for kernel in kernels] == before
