"""A run whose explicit analysis is finite cells ends in a verdict on an independent mesh."""

import json

import meshio
import pytest
from command_run import result_of
from small_parts import SHORT_BAR

from gradedesign.mechanics.explicit.small_solid import FINEST

CASE = (
    SHORT_BAR
    + """
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
size_effects = false
[print]
overhang_angle = "40 deg"
[print.limits]
thickness = "0.1 mm"
islands = 100000
[run]
price = false
analysis = "finite-cells"
acceptance = "whole"
[output]
formats = ["stl", "vtu"]
"""
)


@pytest.mark.slow
def test_a_run_by_finite_cells_is_accepted_by_tetrahedra(tmp_path):
    result = result_of(CASE, tmp_path)
    # Bricks of 1.4 walls or 0.7 of the margins of 1.5 mm, finer as this solid is small.
    assert 1.2 < FINEST * result["iterations"][-1]["spacing_mm"] < 1.5
    assert all(limit["passed"] for limit in result["limits"])
    (tip,) = (row for row in result["limits"] if row["key"]["kind"] == "displacement")
    assert tip["value"] <= tip["limit"]
    lattice = meshio.read(tmp_path / "r" / "lattice.vtu")
    rows = [row["key"]["region"] for row in result["limits"] if row["key"]["kind"] == "print"]
    assert rows == ["thickness", "islands"]
    assert result["measures"]["printability"]["overhang"]["angle_deg"] == 40
    assert {block.type for block in lattice.cells} == {"hexahedron27"}
    scene = json.loads((tmp_path / "r" / "scene.json").read_text(encoding="utf-8"))
    shown = [view["id"] for view in scene["views"]]
    assert shown == ["printed", "stress", "moved", "density", "cells", "case"]
    # The limit is judged on the printed surface, the scene shows the analysis of its field.
    assert 0.9 < scene["analysed"]["cases"][0]["largest"] / tip["value"] < 1.1
