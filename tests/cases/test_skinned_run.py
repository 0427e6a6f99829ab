"""A run with skins on chosen faces and blended joints ends in a verdict on the printed surface."""

import json

import numpy as np
import pytest
from small_parts import SHORT_BAR

from gradedesign.design.case.read_case import load_case
from gradedesign.design.resolve.design_model import prepare
from gradedesign.geometry.formats.write_stl import surface_of_stl, write_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import enclosed_volume, open_edge_count
from gradedesign.program.host.registry import build_registry

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
displacement = [{region = "tip", magnitude = "0.006 mm"}]
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
price = false
analysis = "finite-cells"
acceptance = "whole"
max_iterations = 2
[output]
formats = ["stl"]
"""
)


#: A skin all round, round inside; the room of 2 mm between a wall and the end is too small.
HOLLOW = (
    SHORT_BAR.replace('box = ["16 mm", "8 mm", "8 mm"]', 'file = "bar.stl"\nunits = "mm"')
    + CASE[CASE.index("[[load_case]]") : CASE.index("skin = [")]
    + """
skin = "1 mm"
bevel = "0.8 mm"
least_cavity = "2.5 mm"
[[keep]]
box = {lower = ["11.5 mm", "0 mm", "0 mm"], upper = ["12.5 mm", "8 mm", "8 mm"]}
[print]
outer = "cad"
"""
    + CASE[CASE.index("[run]") :]
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
    part = prepare(case, build_registry()).homogenised
    solid, rho = part.solid_fraction, result["iterations"][-1]["mean_density"]
    predicted = float(part.volumes @ (solid + (1 - solid) * rho)) * part.material.density * 1e6
    assert predicted == pytest.approx(result["mass_g"], rel=0.02)


@pytest.mark.slow
def test_kept_triangles_and_filled_rooms_are_sized_analysed_and_accepted(tmp_path, cli):
    edges = np.array([16.0, 8.0, 8.0])
    write_stl(tmp_path / "bar.stl", box_surface(tuple(edges)))
    (tmp_path / "case.toml").write_text(HOLLOW, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "r")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    assert result["printed"]["outer"] == {"triangles": 12, "kept": "bytes"}
    assert any("least_cavity: 1 cavity is solid" in warning for warning in result["warnings"])
    data = (tmp_path / "r" / "lattice.stl").read_bytes()
    assert data[84:].startswith((tmp_path / "bar.stl").read_bytes()[84:])
    surface = surface_of_stl(data, "lattice.stl")
    assert open_edge_count(surface) == 0
    volumes = result["printed"]["volumes_mm3"]
    assert sum(volumes.values()) == pytest.approx(enclosed_volume(surface), rel=1e-9)
    # Two ends and a wall; lattice in a box of 10 x 6 x 6 mm with round edges (Steiner).
    passive = (1.5 + 1.5 + 1.0) * 64
    r, (a, b, c) = 0.8, np.array([10.0, 6.0, 6.0]) - 1.6
    room = a * b * c + 2 * r * (a * b + b * c + c * a) + np.pi * r**2 * (a + b + c)
    room += 4 / 3 * np.pi * r**3
    assert volumes["passive solid"] == pytest.approx(passive, rel=0.01)
    assert volumes["skin"] == pytest.approx(edges.prod() - passive - room, rel=0.01)
    # Sizing counts the same masses.
    part = prepare(load_case(tmp_path), build_registry()).homogenised
    solid, rho = part.solid_fraction, result["iterations"][-1]["mean_density"]
    predicted = float(part.volumes @ (solid + (1 - solid) * rho)) * part.material.density * 1e6
    assert predicted == pytest.approx(result["mass_g"], rel=0.02)
