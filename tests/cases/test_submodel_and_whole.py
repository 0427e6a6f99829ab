"""Stress of submodels of the printed surface against a mesh of the whole one."""

import pytest
from result_keys import undocumented

import gradedesign
from gradedesign.design.verdict.result import as_json

CASE = """
[case]
name = "four cells"
[part]
box = ["32 mm", "8 mm", "8 mm"]
mesh_size = "2 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "root"
margin = "1 mm"
[[keep]]
region = "tip"
margin = "1 mm"
[[load_case]]
name = "shear"
fix = [{{region = "root"}}]
load = [{{region = "tip", force = ["0 N", "0 N", "-100 N"]}}]
[limits]
safety_factor = 1
displacement = [{{region = "tip", magnitude = "1 mm"}}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
grading = "uniform"
density = [0.4, 0.5]
[run]
price = false
acceptance = "{scope}"
max_iterations = 1
[output]
formats = ["stl"]
"""


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_submodels_find_the_stress_of_the_whole_printed_surface(tmp_path):
    """One design, judged both ways: two of its four cells, or a mesh of all of them.

    The percentile of stress on these meshes is known to 4 %, the band that the rows state. A run
    found 218.7 and 213.4 MPa; submodels driven a tenth too far find 240.5. Driven too little they
    change nothing here: one of them misses its energy, and then the finite cells count, 210 MPa.
    """
    rows = {}
    for scope in ("submodels", "whole"):
        case = tmp_path / scope
        case.mkdir()
        (case / "case.toml").write_text(CASE.format(scope=scope), encoding="utf-8")
        result = gradedesign.run(gradedesign.load_case(case), folder=case / "run")
        assert result.acceptance["scope"] == scope
        assert undocumented(as_json(result)) == []
        # Never below the value that is judged, submodels or not.
        everywhere = result.acceptance["exclusion"]["stress_everywhere_MPa"]
        for row in result.limits:
            if row.phase:
                assert everywhere[row.load_case][row.phase] >= row.value * (1 - 1e-12)
        found = {row["limit"]: row for row in result.acceptance["limits"]}
        rows[scope] = found["displacement of tip magnitude"], found["stress in lattice"]
    (moved, submodels), (again, whole) = rows["submodels"], rows["whole"]
    assert moved["value"] == pytest.approx(again["value"], rel=1e-6)
    assert submodels["mesher"] == whole["mesher"] == "pytetwild"
    assert submodels["value"] == pytest.approx(whole["value"], rel=0.05)
    assert submodels["low"] <= whole["value"] <= submodels["high"]
