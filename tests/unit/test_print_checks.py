"""``[print]`` through the commands: optional keys, rows of the verdict, warnings, exit codes."""

import json

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from gradedesign.design.case.wall_checks import feather_problems
from gradedesign.design.printing import print_checks
from gradedesign.design.printing.print_schema import PrintLimitsSpec, PrintSpec
from gradedesign.design.printing.printability import measure_printability
from gradedesign.design.printing.wall_thickness import wall_thickness
from gradedesign.design.verdict.printable import with_print_limits
from gradedesign.design.verdict.result import RunResult, as_json, from_json
from gradedesign.geometry.triangles.surface_mesh import SurfaceMesh
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow
from gradedesign.program.outputs.report import render_report

CASE = """\
[case]
name = "print checks"
[part]
box = ["10 mm", "5 mm", "5 mm"]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.4
[print]
build_direction = "+x"
{keys}
"""


def generated(cli, folder, keys, code):
    (folder / "case.toml").write_text(CASE.format(keys=keys), encoding="utf-8")
    ended = cli("run", folder, "-o", folder / "out", "--overwrite")
    assert ended.code == code, ended.err
    path = folder / "out" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8")) if code in (0, 4) else {}
    return result, " ".join((ended.out + ended.err).split())


def test_without_min_wall_the_rest_of_print_is_checked_and_warned_of(cli, tmp_path):
    result, told = generated(cli, tmp_path, "", 0)
    assert result["status"] == "partial"
    assert result["limits"] == []
    found = result["measures"]["printability"]
    assert set(result["printed"]["thickness_percentiles_mm"]) == {"0.1", "1", "5", "50"}
    assert found["build_direction"] == "+x"
    assert found["overhang"]["angle_deg"] == 45
    shares = list(found["overhang"]["share_by_angle_deg"].values())
    assert shares == sorted(shares)
    # A sheet gyroid parts two voids that are open on the faces of the box.
    assert found["voids"]["closed"] == 0
    assert found["voids"]["trapped_volume_mm3"] == 0
    assert found["voids"]["volume_mm3"] == pytest.approx(0.6 * 250, rel=0.02)
    throats = list(found["voids"]["pore_throat_percentiles_mm"].values())
    assert 0 < throats[0] < throats[1] < 5
    assert found["islands"]["count"] > 0
    for words in ("islands begin in layers", "of support"):
        assert words in told


def test_a_broken_limit_is_a_row_and_ends_not_met(cli, tmp_path):
    keys = (
        'min_throat = "0.5 mm"\n[print.limits]\nislands = 0\nthickness = "0.1 mm"\n'
        'support_volume = "1 m^3"\noverhang = 0.9\ntrapped_powder = "0 mm^3"\n'
        'pore_throat = "0.5 mm"'
    )
    result, told = generated(cli, tmp_path, keys, 4)
    assert result["status"] == "not_met"
    rows = {row["key"]["region"]: row for row in result["limits"]}
    assert {name for name, row in rows.items() if not row["passed"]} == {"islands"}
    assert rows["islands"]["utilisation"] is None
    assert rows["trapped_powder"]["utilisation"] == 0
    assert set(rows) == {
        "islands", "thickness", "support_volume", "overhang", "trapped_powder", "pore_throat",
    }  # fmt: skip
    assert "print islands is" in told
    assert "BROKEN" in told
    # What a limit speaks of is not warned of beside it.
    assert "begin in layers" not in told


def test_a_throat_that_no_grid_resolves_is_refused_at_the_start(cli, tmp_path):
    keys = 'min_throat = "2 um"'
    _, told = generated(cli, tmp_path, keys, 5)
    assert "print.min_throat" in told
    assert "state a wider throat" in told


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('as_built_offset = [["0 deg", "1 mm"]]', "write its pairs as offset in [process]"),
        ('[print.limits]\nsupport_volume = "3 mm"', "a volume"),
        ("[print.limits]\nislands = 0.5", "whole number"),
    ],
)
def test_wrong_keys_are_refused_with_what_is_expected(cli, tmp_path, keys, words):
    _, told = generated(cli, tmp_path, keys, 2)
    assert words in told


def test_nothing_allowed_is_a_limit_too():
    row = LimitRow(
        key=LimitKey(kind="print"), name="", load_case="", value=0.0, limit=0.0, unit="",
        judged_by="",
    )  # fmt: skip
    assert row.passed
    assert not LimitRow(
        key=LimitKey(kind="print"), name="", load_case="", value=1e-9, limit=0.0, unit="",
        judged_by="",
    ).passed  # fmt: skip


def test_print_tables_may_be_empty():
    assert PrintSpec().min_wall is None
    assert PrintLimitsSpec().islands is None


def test_a_met_design_that_breaks_a_print_limit_is_not_met_and_reported(tmp_path):
    tee = sum(
        (
            Manifold.cube(edges).translate(low)
            for low, edges in (((4, 0, 0), (2.0, 2.0, 4.5)), ((0, 0, 4.5), (10.0, 2.0, 1.0)))
        ),
        Manifold(),
    ).to_mesh64()
    surface = SurfaceMesh(
        vertices=np.asarray(tee.vert_properties)[:, :3],
        faces=np.asarray(tee.tri_verts).astype(np.int64),
    )
    spec = PrintSpec(
        min_throat="2 mm",
        limits=PrintLimitsSpec(support_volume="50 mm^3", thickness="0.5 mm"),
    )
    found = measure_printability(surface, surface, spec, wall_thickness(surface, rays=1000))
    met = RunResult(status="met", lightest=True, reason="all holds", folder=tmp_path)
    result = with_print_limits(met, spec, found)
    assert (result.status, result.lightest) == ("not_met", False)
    # 8 x 2 mm of the bar, 4.5 mm up.
    assert "all holds; but print support volume is 7" in result.reason
    assert result.reason.endswith("(another [print] build_direction or another cell would help)")
    assert [row.passed for row in result.limits] == [True, False]
    data = as_json(result)
    assert data["measures"]["printability"]["islands"]["count"] == 0
    assert from_json(json.loads(json.dumps(data))).limits == result.limits
    page = render_report(result, {}, "")
    for words in ("How it is printed", "print support volume", "BROKEN"):
        assert words in page
    assert with_print_limits(met, spec, None) == met


def test_feather_edges_are_a_warning_or_a_row():
    wedge = Manifold.extrude(CrossSection([[(0, 0), (10, 0), (10, 3)]]), 6.0).to_mesh64()
    surface = SurfaceMesh(
        vertices=np.asarray(wedge.vert_properties)[:, :3],
        faces=np.asarray(wedge.tri_verts).astype(np.int64),
    )
    met = RunResult(status="met", lightest=True, reason="all holds")

    def printed(**limits):
        spec = PrintSpec(min_wall="0.5 mm", limits=PrintLimitsSpec(**limits))
        solid = wall_thickness(surface, rays=1000)
        found = measure_printability(surface, surface, spec, solid)
        return with_print_limits(met, spec, found)

    warned = printed()
    (words,) = (words for words in warned.warnings if words.startswith("feather edges: "))
    # 2 x 6 mm over 0.5 / tan(16.7 deg) = 1.67 mm: 20 mm^2 of 60 + 62.6 + 16 x 3.
    assert "feather edges: 0.12 of the printed surface, 20" in words
    assert "a skin or [[keep]] below that face" in words
    broken = printed(feather_edges=0.1)
    (row,) = broken.limits
    assert (broken.status, row.passed, row.value) == ("not_met", False, pytest.approx(0.117, 0.02))
    assert "print feather edges is 0.117" in broken.reason
    assert not [words for words in broken.warnings if words.startswith("feather edges: ")]
    page = render_report(broken, {}, "")
    assert "% of the surface has less than 0.5 mm of solid behind it at rims" in page


def test_a_limit_on_feather_edges_needs_a_wall():
    spec = PrintSpec(limits=PrintLimitsSpec(feather_edges=0.1))
    (problem,) = feather_problems(spec)
    assert problem.key == ("print", "limits", "feather_edges")
    assert "without [print] min_wall" in problem.message
    assert list(feather_problems(spec.model_copy(update={"min_wall": 0.4}))) == []


def test_every_limit_of_the_print_has_a_remedy():
    assert set(print_checks._HELPS) == set(PrintLimitsSpec.model_fields)
