"""A run with a process: the as-built body decides, both bodies stand in rows and report."""

import json

import pytest
from result_keys import undocumented
from small_parts import SHORT_BAR

CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.02 mm"}]
judged = "as_built"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.3, 0.7]
size_effects = false
[process]
offset = [["0 deg", "-0.06 mm"]]
scatter = "0.05 mm"
variants = 3
compensate = false
[run]
price = false
[output]
formats = ["stl", "report"]
"""
)


@pytest.mark.slow
def test_sizing_meets_the_body_that_is_built(cli, tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "met"
    assert undocumented(result) == []
    (row,) = (row for row in result["limits"] if row["key"]["kind"] == "displacement")
    # Walls that lose 0.06 mm on either side: the designed body is stiffer than it had to be.
    assert row["nominal"] < 0.97 * row["as_built"]
    assert row["value"] == row["as_built"]
    assert row["decisive"] <= row["limit"]
    assert row["judged_by"].startswith("finite cells on the whole as-built surface")
    built = result["measures"]["as_built"]
    assert built["as_built_g"] < 0.99 * built["nominal_g"]
    assert built["nominal_g"] == pytest.approx(result["mass_g"])
    # The elements hold what the moved surface encloses.
    assert built["elements_mm3"]["as built"] == pytest.approx(built["as_built_mm3"], rel=0.01)
    (spread,) = built["variants"]
    assert spread["low"] < spread["mean"] < spread["high"]
    assert f"as built by stated: {built['as_built_g']:.4g} g" in ended.out
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for words in ("<h2>As built</h2>", "the as-built body;", "over random as-built bodies"):
        assert words in page


@pytest.mark.slow
def test_a_body_that_is_softer_along_the_build_direction_bends_more(cli, tmp_path):
    """Of the bar's deflection bending, along x, has two thirds or so, and shear the rest."""
    softer = "stiffness = 1.0\nstiffness_along = 0.5\nshear_along = 1.0\n[print]\n"
    i, j = CASE.index("offset"), CASE.index("[run]")
    case = CASE[:i] + softer + 'build_direction = "+x"\n' + CASE[j:]
    text = case.replace('judged = "as_built"', 'judged = "both"').replace('"0.02', '"0.04')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == 0, ended.out + ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    (row,) = (row for row in result["limits"] if row["key"]["kind"] == "displacement")
    assert 1.4 < row["as_built"] / row["nominal"] < 1.9
    assert row["value"] == row["as_built"]
    built = result["measures"]["as_built"]
    assert (built["stiffness"], built["stiffness_along"]) == (1.0, 0.5)
    assert built["as_built_g"] == pytest.approx(built["nominal_g"])
