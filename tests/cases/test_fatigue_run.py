"""A run with a limit of fatigue ends in a verdict on the printed file."""

import pytest
from command_run import result_of
from small_parts import SHORT_BAR

CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "pull"
fix = [{region = "root"}]
load = [{region = "tip", force = ["1 kN", "0 N", "0 N"]}]
[limits]
fatigue = [{cycles = 1e5, ratio = 0.1, surface = "as-built", safety_factor = 1.2}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.5, 0.7]
size_effects = false
[run]
price = false
[output]
formats = ["stl"]
"""
)


@pytest.mark.slow
def test_a_bar_that_is_pulled_often_is_judged_on_its_printed_file(tmp_path):
    result = result_of(CASE, tmp_path)
    assert result["lightest"]
    rows = {row["name"]: row for row in result["limits"] if row["key"]["kind"] == "fatigue"}
    assert set(rows) == {"fatigue in lattice", "fatigue in passive solid"}
    # Read at 1e5 cycles between 405.6 at 1.43e4 and 195.8 at 2e6: 304.5 MPa, times (2 / 0.9)^0.5.
    for row in rows.values():
        assert row["limit"] == pytest.approx(304.5 * (2 / 0.9) ** 0.5 / 1.2, rel=1e-3)
        assert row["stated"] == "100000 cycles at R = 0.1, as-built"
        assert row["key"]["load_case"] == row["load_case"] == "pull"
        assert row["band"]["low"] < row["value"] < row["band"]["high"] == row["decisive"]
    lattice = rows["fatigue in lattice"]
    assert lattice["judged_by"] == "re-meshed whole lattice"
    # Buckling of cells is judged beside it, as beside a stress.
    assert any(row["key"]["kind"] == "buckling" for row in result["limits"])
