"""Share of the critical stress that cells between free faces keep."""

from __future__ import annotations

import json

import pytest

from gradedesign import load_case, run

CASE = """\
[case]
name = "post"
[part]
box = ["20 mm", "30 mm", "90 mm"]
mesh_size = "12 mm"
[region.root]
plane = "z = min"
[region.tip]
plane = "z = max"
[material]
name = "PA12"
[[load_case]]
name = "press"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-60 N"]}]
[limits]
stress = "40 MPa"
[lattice]
cell = "gyroid-sheet"
size = "10 mm"
density = [0.199, 0.201]
phases = ["lattice"]
[run]
stop_after = "sizing"
[output]
formats = []
"""


def use(folder, text):
    """Use of the resistance against buckling in the one prediction of a run."""
    folder.mkdir()
    (folder / "case.toml").write_text(text, encoding="utf-8")
    result = run(load_case(folder), folder=folder / "run")
    (row,) = [row for row in result.limits if row.name == "buckling of cells"]
    return row.value


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Use in the case as it stands."""
    return use(tmp_path_factory.mktemp("cut") / "plain", CASE)


def test_two_cells_across_bear_four_sevenths(plain, tmp_path):
    # Two cells across x, three across y: 2 / (2 + 1.5) where the walls are modelled; a skin ties
    # the faces and leaves the share out, as size_effects = false does.
    whole = use(tmp_path / "whole", CASE.replace("density =", "size_effects = false\ndensity ="))
    # Walls change the stress at the held root a little.
    assert whole / plain == pytest.approx(2 / 3.5, rel=0.12)


def test_other_cells_count_as_one_wall_of_the_largest(tmp_path):
    # 20 mm across at the median, cells of up to 12.5 mm: 1.6 / (1.6 + 1.5).
    sizes = 'size = ["10 mm", "12.5 mm", "10 mm"]\nlaw = "gyroid-sheet-computed"'
    other = CASE.replace('size = "10 mm"', sizes)
    cut = use(tmp_path / "cut", other)
    whole = use(tmp_path / "whole", other.replace("density =", "size_effects = false\ndensity ="))
    assert whole / cut == pytest.approx(1.6 / 3.1, rel=0.02)


def test_check_and_result_state_buckling_alike(plain, tmp_path, cli):
    """As a share of the critical stress; before, "1/2" stood in the one and 1 in the other."""
    twice = tmp_path / "twice"
    use(twice, CASE.replace('stress = "40 MPa"', 'stress = "40 MPa"\nbuckling_factor = 2'))
    result = json.loads((twice / "run" / "result.json").read_text(encoding="utf-8"))
    (row,) = [row for row in result["limits"] if row["name"] == "buckling of cells"]
    assert (row["limit"], row["unit"]) == (0.5, "of the critical stress")
    # The same design: the factor is on the limit's side alone.
    assert row["value"] == pytest.approx(plain, rel=0.02)
    assert row["utilisation"] == pytest.approx(2 * row["value"])
    assert result["law"]["buckling_factor"] == 2.0
    told = json.loads(cli("check", twice, "--json", "--no-picture").out)["limits"]
    assert "0.5 of the critical stress" in [limit["allowed"] for limit in told]
