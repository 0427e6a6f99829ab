"""iterations.csv: one value in a field, a unit in every header."""

import csv
from io import StringIO

import numpy as np

from gradedesign.ladder.iteration_log import iteration_log
from gradedesign.ladder.result import Iteration
from gradedesign.sizing.responses import DisplacementLimit


def limit(name, load_case):
    nodes = np.arange(3)
    return DisplacementLimit(name=name, load_case=load_case, nodes=nodes, component=None, limit=1.0)


def iteration(number):
    return Iteration(
        round=number,
        lattice_mass_g=1.5,
        mass_g=2.0,
        mean_density=0.25,
        predicted_displacement=(0.1, 0.2),
        explicit_displacement=(0.11, 0.18),
        predicted_stress=None,
        explicit_stress=40.0,
        displacement_gap=(0.1, -0.1),
        stress_gap=None,
        use=0.98,
        passed=True,
        dofs=12345,
        mesh_size_mm=0.5,
        seconds=3.25,
        stiffness_factor=1.0,
        stress_factor=1.0,
        sizing_iterations=8,
        sizing_converged=False,
    )


def test_every_field_holds_one_value_and_every_header_a_unit():
    limits = (limit("tip magnitude", "pull"), limit("tip z, far end", "side"))
    rows = list(csv.reader(StringIO(iteration_log([iteration(1), iteration(2)], limits))))
    header, first, second = rows
    assert all(name.endswith("]") and " [" in name for name in header)
    assert len(set(header)) == len(header) == len(first) == len(second)
    for value in (*first, *second):
        assert value == "" or np.isfinite(float(value))
    found = dict(zip(header, first, strict=True))
    assert found["explicit displacement of tip magnitude (pull) [mm]"] == "0.11"
    assert found["explicit displacement of tip z, far end (side) [mm]"] == "0.18"
    assert found["displacement gap of tip z, far end (side) [-]"] == "-0.1"
    assert found["predicted lattice stress [MPa]"] == ""
    assert found["every limit holds [-]"] == "1"
    assert found["time [s]"] == "3.25"


def test_a_run_without_rounds_has_the_header_only():
    (line,) = iteration_log([], [limit("tip", "pull")]).splitlines()
    assert line.startswith("round [-],mass [g]")
    assert "displacement of tip (pull) [mm]" in line
