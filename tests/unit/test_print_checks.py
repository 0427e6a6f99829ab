"""``[print]`` through the commands: optional keys, rows of the verdict, warnings, exit codes."""

import json

import pytest

from gradedesign.case.print_schema import PrintLimitsSpec, PrintSpec
from gradedesign.limits.key import LimitKey
from gradedesign.limits.row import LimitRow

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
    ended = cli("generate", folder, "-o", folder / "out", "--overwrite")
    assert ended.code == code, ended.err
    path = folder / "out" / "result.json"
    result = json.loads(path.read_text(encoding="utf-8")) if code in (0, 4) else {}
    return result, " ".join((ended.out + ended.err).split())


def test_without_min_wall_the_rest_of_print_is_checked_and_warned_of(cli, tmp_path):
    result, told = generated(cli, tmp_path, 'as_built_offset = [["0 deg", "0.1 mm"]]', 0)
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
    assert found["as_built"]["share"] > 0
    for words in ("islands begin in layers", "of support", "as built", "stiffness and stress"):
        assert words in told


def test_a_broken_limit_is_a_row_and_ends_not_met(cli, tmp_path):
    keys = (
        'min_throat = "0.5 mm"\n[print.limits]\nislands = 0\nthickness = "0.1 mm"\n'
        'support_volume = "1 m^3"\noverhang = 0.9\ntrapped_powder = "0 mm^3"\n'
        'pore_throat = "0.2 mm"'
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
        ('as_built_offset = ["0 deg"]', "expected a pair"),
        ('as_built_offset = [["9 deg", "0 mm"], ["9 deg", "1 mm"]]', "expected rising angles"),
        ('as_built_offset = [["0 deg", "1 m"]]', "at most 10 mm"),
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
