"""Passive solids stated by volume are sized, analysed, accepted and printed as by region."""

import json

import pytest
from small_parts import SHORT_BAR

START = SHORT_BAR.index("[[keep]]")
CASE = (
    SHORT_BAR[:START]
    + """\
[[keep]]
box = {lower = ["0 mm", "0 mm", "0 mm"], upper = ["1.5 mm", "8 mm", "8 mm"]}
[[keep]]
cylinder = {diameter = "20 mm", ends = [["14.5 mm", "4 mm", "4 mm"], ["20 mm", "4 mm", "4 mm"]]}
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.4, 0.7]
grading = "uniform"
[run]
analysis = "finite-cells"
acceptance = "whole"
max_iterations = 2
[output]
formats = ["stl"]
"""
)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_run_with_volumes_ends_as_one_with_regions(tmp_path, cli):
    """The same run with regions root and tip and margins of 1.5 mm ends met with 2.3196 g, of it
    191.92 mm^3 passive, and 0.034799 mm."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "r")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    assert result["mass_g"] == pytest.approx(2.3196, rel=0.002)
    # Two ends of 1.5 x 8 x 8 mm.
    assert result["printed"]["volumes_mm3"]["passive solid"] == pytest.approx(192.0, rel=0.002)
    (row,) = (r for r in result["limits"] if r["name"] == "displacement of tip magnitude")
    assert row["value"] == pytest.approx(0.034799, rel=0.005)
