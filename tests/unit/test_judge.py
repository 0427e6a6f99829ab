"""A body made elsewhere, judged by the limits of a case."""

from __future__ import annotations

import json

import numpy as np
import pytest
from trimesh.creation import icosphere
from trimesh.util import concatenate
from typer.testing import CliRunner

from gradedesign.errors import UNMET, CaseError, LatticeError
from gradedesign.geometry.formats.write_stl import write_stl
from gradedesign.geometry.part.box import box_surface
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh, integral_mean_curvature
from gradedesign.program.commands.app import app

CASE = """
[case]
name = "bar"
[part]
box = ["40 mm", "8 mm", "10 mm"]
mesh_size = "2 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[load_case]]
name = "bend"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-300 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "4 mm"
"""


def judged(folder, edges, *options, case=CASE, at=(0.0, 0.0, 0.0)):
    """Exit code and output of the command for a box in the place of the bar."""
    (folder / "case.toml").write_text(case)
    box = box_surface(edges)
    moved = SurfaceMesh(vertices=box.vertices + np.array(at), faces=box.faces)
    write_stl(folder / "body.stl", moved)
    arguments = ["judge", str(folder), str(folder / "body.stl"), *options]
    return CliRunner().invoke(app, arguments)


def test_mean_curvature_of_a_box_and_of_a_hollow_ball():
    """Of edges a, b, c: pi (a + b + c); of a ball 4 pi r, and of a hole in it as much less."""
    assert integral_mean_curvature(box_surface((40.0, 8.0, 10.0))) == pytest.approx(58 * np.pi)
    ball = icosphere(subdivisions=4, radius=3.0)
    hole = icosphere(subdivisions=4, radius=2.0)
    hole.invert()
    both = concatenate([ball, hole])
    found = integral_mean_curvature(SurfaceMesh(vertices=both.vertices, faces=both.faces))
    # Facets of 2.2 degrees turn over edges that are shorter than arcs by a thousandth.
    assert found == pytest.approx(4 * np.pi, rel=2e-3)


def test_the_bar_itself_bends_as_its_solid_analysis_says(tmp_path):
    """The body is the whole part: quadratic tetrahedra of scikit-fem judge it too."""
    said = judged(tmp_path, (40.0, 8.0, 10.0), "--json")
    assert said.exit_code == 0, said.output
    data = json.loads(said.stdout)
    assert (data["status"], data["ended_by"]) == ("met", "judged")
    (row,), (solid,) = data["limits"], data["solid"]
    # Half of the band of finite cells, and tetrahedra of 2 mm that are 0.2 % stiffer than of 1 mm.
    assert row["value"] == pytest.approx(solid["value"], rel=0.006)
    assert row["band"]["low"] <= row["value"] <= row["band"]["high"] < 1.02 * row["value"]
    # 3200 mm^3 of 4.41 g/cm^3.
    assert data["mass_g"] == pytest.approx(14.112, rel=1e-6)
    assert data["relative_density"] == pytest.approx(1.0, rel=1e-9)
    assert set(data["checksums"]["part"]) == {"body.stl"}
    assert not [told for told in data["warnings"] if "of its area" in told]


def test_half_of_its_depth_bends_eight_times_as_far(tmp_path):
    """Refused with the exit code of a run that is not met; bending alone grows by eight."""
    said = judged(tmp_path, (40.0, 8.0, 5.0), "--json")
    assert said.exit_code == UNMET
    data = json.loads(said.stdout)
    assert data["status"] == "not_met"
    assert "% of the allowed 0.1 mm" in data["reason"]
    (row,), (solid,) = data["limits"], data["solid"]
    words = [told for told in data["warnings"] if "of its area" in told]
    assert [told.partition(":")[0] for told in words] == ["region 'root'", "region 'tip'"]
    assert all("the body has 50% of its area" in told for told in words)
    # Timoshenko: bending 0.0844 mm of the whole bar grows by 8, shear 0.0042 mm by 2. The clamped
    # end, which his beam has not, is 3 % of the deflection of the whole bar, and less of half.
    assert row["value"] / solid["value"] == pytest.approx((8 * 0.0844 + 2 * 0.0042) / 0.0886, 0.02)


def test_a_stated_density_is_judged_by_its_file(tmp_path):
    """The density that a case states stands in the surface; its limits are judged on that."""
    said = judged(tmp_path, (40.0, 8.0, 10.0), case=CASE + "density = 0.4\n")
    assert said.exit_code == 0
    assert "MET: every limit holds" in said.output


def test_fatigue_of_a_pulled_bar_is_judged_to_the_end(tmp_path):
    """8 kN on 80 mm^2 are 100 MPa, and nothing of a body without members is left unjudged."""
    limits = 'fatigue = [{cycles = 1e5, ratio = 0.1, surface = "as-built", safety_factor = 2}]'
    case = CASE.replace('displacement = [{region = "tip", magnitude = "0.1 mm"}]', limits)
    case = case.replace('["0 N", "0 N", "-300 N"]', '["8 kN", "0 N", "0 N"]')
    said = judged(tmp_path, (40.0, 8.0, 10.0), "--json", case=case)
    assert said.exit_code == 0, said.output
    data = json.loads(said.stdout)
    (row,), (solid,) = data["limits"], data["solid"]
    assert row["name"] == "fatigue in the body outside kept solid"  # of which no lattice is known
    # As near to tetrahedra of scikit-fem as the displacements of this bar, above; what exceeds 100
    # MPa lies at the clamped end, beyond the exclusion radius.
    assert row["value"] == pytest.approx(solid["value"], rel=0.006)
    assert row["band"]["low"] < 100.0 < row["value"] < 105.0
    # 304.5 MPa of amplitude at 1e5 cycles and R = -1, by Walker's rule with 0.5, over 2.
    assert row["limit"] == pytest.approx(304.5 * (2 / 0.9) ** 0.5 / 2, rel=1e-3)
    left = [told for told in data["warnings"] if "not judged" in told]
    assert [told.partition(":")[0] for told in left] == ["buckling of cells"]


def test_limits_of_the_printed_solid_are_judged_too(tmp_path):
    """All of the bar is 8 mm thick or more, and none of its keys would make it thicker."""
    printed = CASE + '[print]\n[print.limits]\nthickness = "9 mm"\nislands = 0\n'
    said = judged(tmp_path, (40.0, 8.0, 10.0), "--json", case=printed)
    assert said.exit_code == UNMET
    data = json.loads(said.stdout)
    rows = {row["name"]: row for row in data["limits"]}
    assert rows["print thickness"]["value"] == pytest.approx(8.0, rel=1e-6)
    assert rows["print islands"]["value"] == 0.0
    assert data["reason"].endswith("but print thickness is 8 mm instead of at least 9 mm")
    assert data["measures"]["printability"]["build_direction"] == "+z"


def test_a_body_that_misses_a_support_is_refused_with_its_name(tmp_path):
    said = judged(tmp_path, (35.0, 8.0, 10.0), at=(5.0, 0.0, 0.0))
    assert isinstance(said.exception, LatticeError)
    assert "region 'root' carries no solid" in str(said.exception)
    assert "let a body that was made elsewhere reach it" in str(said.exception)


@pytest.mark.parametrize(
    ("arguments", "at", "case", "words"),
    [
        ((), (3.0, 0.0, 0.0), CASE, "reaches 3 mm beyond the part box, whose diagonal is 42"),
        (("--units", "inch"), (0, 0, 0), CASE, "expected a body inside the part"),
        (("--units", "ft"), (0, 0, 0), CASE, '--units: found "ft"'),
        ((), (0, 0, 0), CASE.replace("displacement =", "#") + "density = 0.4", "has no limits"),
    ],
)
def test_what_cannot_be_judged_is_refused_with_what_to_do(tmp_path, arguments, at, case, words):
    said = judged(tmp_path, (40.0, 8.0, 10.0), *arguments, case=case, at=at)
    assert isinstance(said.exception, CaseError)
    assert words in str(said.exception)
