"""A run with skins on chosen faces and blended joints ends in a verdict on the printed surface."""

import json

import pytest
from small_parts import SHORT_BAR

from gradedesign.case.read_case import load_case
from gradedesign.mesh.tet_mesh import signed_volumes
from gradedesign.plugin.registry import build_registry
from gradedesign.resolve.setup import prepare

CASE = (
    SHORT_BAR
    + """
[region.top]
plane = "z = max"
[region.bottom]
plane = "z = min"
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
skin = [
    {thickness = "1.5 mm", faces = "top"},
    {thickness = ["1 mm", "2 mm"], formula = "clamp(1 + x / 16, 1, 2)", faces = ["bottom"]},
]
joint_radius = "0.8 mm"
[run]
analysis = "finite-cells"
acceptance = "whole"
max_iterations = 2
[output]
formats = ["stl"]
"""
)


@pytest.mark.slow
def test_skins_and_joints_are_sized_analysed_and_accepted(tmp_path, cli):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "r")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    assert {row["name"] for row in result["limits"]} >= {"displacement of tip magnitude"}
    printed = result["printed"]
    # Area times thickness, between the passive ends of 1.5 mm, 1.5 mm below the top and 1.5 mm
    # on average above the bottom.
    case = load_case(tmp_path)
    x, y, _ = case.part.box
    assert printed["volumes_mm3"]["skin"] == pytest.approx((x - 3) * y * 3.0, rel=0.01)
    assert printed["joints_mm3"] > 0
    # Sizing knows skins and joints: its mass is that of the file.
    problem = prepare(case, build_registry()).problem
    volumes = signed_volumes(problem.space.mesh)
    solid, rho = problem.solid_fraction, result["iterations"][-1]["mean_density"]
    predicted = float(volumes @ (solid + (1 - solid) * rho)) * problem.material.density * 1e6
    assert predicted == pytest.approx(result["mass_g"], rel=0.02)
