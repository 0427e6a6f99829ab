"""iterations.csv: one value in a field, a unit in every header."""

import csv
from io import StringIO

import numpy as np

from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.program.outputs.iteration_log import iteration_log


def limit(name, load_case, predicted, explicit, discrepancy):
    return LimitIteration(
        key=LimitKey(kind="displacement", region=name, load_case=load_case),
        name=f"displacement of {name}",
        unit="mm",
        predicted=predicted,
        explicit=explicit,
        discrepancy=discrepancy,
        factor=1.0,
    )


LIMITS = (
    limit("tip magnitude", "pull", 0.1, 0.11, 0.1),
    limit("tip z, far end", "side", 0.2, 0.18, -0.1),
    limit("cells", "", 0.5, None, None),
)


def iteration(number):
    return Iteration(
        number=number,
        lattice_mass_g=1.5,
        mass_g=2.0,
        mean_density=0.25,
        limits=LIMITS,
        utilisation=0.98,
        passed=True,
        dofs=12345,
        mesh_size_mm=0.5,
        spacing_mm=0.5,
        seconds=3.25,
        stiffness_factor=1.0,
        sizing_iterations=8,
        sizing_converged=False,
    )


def test_every_field_holds_one_value_and_every_header_a_unit():
    rows = list(csv.reader(StringIO(iteration_log([iteration(1), iteration(2)]))))
    header, first, second = rows
    assert all(name.endswith("]") and " [" in name for name in header)
    assert len(set(header)) == len(header) == len(first) == len(second)
    for value in (*first, *second):
        assert value == "" or np.isfinite(float(value))
    found = dict(zip(header, first, strict=True))
    assert found["explicit displacement of tip magnitude (pull) [mm]"] == "0.11"
    assert found["explicit displacement of tip z, far end (side) [mm]"] == "0.18"
    assert found["discrepancy of displacement of tip z, far end (side) [-]"] == "-0.1"
    assert found["explicit displacement of cells [mm]"] == ""
    assert found["every limit holds [-]"] == "1"
    assert found["time [s]"] == "3.25"


def test_a_run_without_iterations_has_the_header_only():
    (line,) = iteration_log([]).splitlines()
    assert line.startswith("iteration [-],mass [g]")
