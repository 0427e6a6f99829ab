"""Displacement limits: stated in mm or relative to the solid part, refused where nothing moves."""

import json

import pytest
from small_parts import box_part, held_bar

import gradedesign
from gradedesign.design.case.schema import CaseFile, SolidMultiple, schema_json
from gradedesign.errors import CaseError
from gradedesign.mechanics.limits.limits_schema import as_multiple, stated_words
from gradedesign.program.outputs.report import render_report

CASE = (
    held_bar(box_part(60, 10, 10, 5), name="bar", load_case="down")
    + """\
[[load_case]]
name = "along"
fix = [{region = "root"}]
load = [{region = "tip", force = ["200 N", "0 N", "0 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "2 x solid"}]
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
grading = "uniform"
density = [0.2, 0.5]
[run]
stop_after = "solid"
[output]
formats = []
"""
)


@pytest.fixture
def load(tmp_path):
    def _load(*swaps):
        text = CASE
        for old, new in swaps:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        return gradedesign.load_case(tmp_path)

    return _load


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("2 x solid", 2.0),
        ("2x solid", 2.0),
        ("1.5 X Solid", 1.5),
        (" 3 × solid ", 3.0),
        ("4 * SOLID", 4.0),
        ("1 x solid", 1.0),
    ],
)
def test_a_multiple_of_the_solid_part_is_read(load, text, factor):
    limit = load(("2 x solid", text)).limits.displacement[0]
    assert limit.magnitude == SolidMultiple(factor=factor)
    assert (as_multiple(limit.magnitude), stated_words(limit.magnitude, "mm")) == (
        factor,
        f"{factor:g} x solid",
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0.9 x solid", "the solid part itself breaks"),
        ("0 x solid", "the solid part itself breaks"),
        ("2 x sold", "2 x solid"),
        ("-2 x solid", "2 x solid"),
        ("solid", "2 x solid"),
        ("2", "2 x solid"),
    ],
)
def test_other_magnitudes_are_refused_with_what_would_be_right(load, text, words):
    with pytest.raises(
        CaseError, match=r"case.toml:21: limits.displacement\[0\].magnitude"
    ) as error:
        load(("2 x solid", text))
    assert words in str(error.value)


def test_the_hash_of_a_case_tells_limits_apart_and_the_schema_knows_both_forms(load):
    stated = [load(("2 x solid", text)).case_hash for text in ("2 x solid", "2x solid", "2 mm")]
    assert stated[0] == stated[1] != stated[2]
    magnitude = schema_json(CaseFile)["definitions"]["DisplacementLimit"]["properties"]["magnitude"]
    assert magnitude["type"] == "string"
    assert "1.5 x solid" in magnitude["examples"]


def test_every_load_case_has_its_own_multiple(load, tmp_path):
    """In mm, with the words beside it, in the log, result.json and the report."""
    said = []
    result = gradedesign.run(
        load(), folder=tmp_path / "run", on_event=lambda event: said.append(event.message)
    )
    assert result.status == "partial"
    down, along = result.solid
    assert (down.load_case, along.load_case) == ("down", "along")
    # Euler and Timoshenko: F l^3 / 3 E I + F l / kappa G A, nu 0.4; a bar: F l / E A. Coarse mesh.
    modulus = along.value and 200 * 60 / (100 * along.value)
    assert down.value == pytest.approx(10 * 60**3 * 12 / (3 * modulus * 10**4), rel=0.05)
    for row in (down, along):
        assert row.limit == pytest.approx(2 * row.value)
        assert (row.utilisation, row.stated) == (pytest.approx(0.5), "2 x solid")
        assert row.measure == "largest nodal value on the region"
    assert any("(down)" in m and "mm (2 x solid), 50.0%" in m for m in said)
    data = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    rows = data["solid"]
    assert [(r["load_case"], r["utilisation"], r["unit"]) for r in rows] == [
        ("down", pytest.approx(0.5), "mm"), ("along", pytest.approx(0.5), "mm"),
    ]  # fmt: skip
    html = render_report(result, {}, "").replace("\u00a0", " ")
    assert f"{down.limit:.4g} mm (2 x solid)" in html
    assert "largest nodal value on the region" in html


def test_sizing_uses_the_resolved_limit(load, tmp_path):
    swaps = (('"2 x solid"', '"12 x solid", load_case = "down"'), ('"solid"', '"sizing"'))
    result = gradedesign.run(load(*swaps), folder=tmp_path / "run")
    (row,), (solid,) = result.limits, result.solid
    assert (row.stated, row.limit) == ("12 x solid", pytest.approx(12 * solid.value))
    assert row.utilisation == pytest.approx(0.998, abs=0.005)


def test_a_sized_lattice_that_breaks_a_limit_is_said(load, tmp_path):
    # At the upper density, half as dense as solid, the bar gives more than twice as much.
    case = load(('"solid"', '"sizing"'))
    result = gradedesign.run(case, folder=tmp_path / "run")
    assert result.status == "partial"
    assert not result.measures["sizing"]["feasible"]
    assert any("the sized lattice breaks a limit" in text for text in result.warnings)


def test_lengths_stay_as_they_are(load, tmp_path):
    result = gradedesign.run(load(("2 x solid", "30 mm")), folder=tmp_path / "run")
    assert [(row.limit, row.stated) for row in result.solid] == [(30.0, "")] * 2


def test_check_prints_the_words(cli, load, tmp_path):
    load()
    ended = cli("check", tmp_path)
    assert ended.code == 0
    assert "2 x solid" in ended.out
    data = json.loads(cli("check", tmp_path, "--json").out)
    assert data["limits"][0] == {
        "name": "displacement of tip magnitude", "load_case": "down", "allowed": "2 x solid",
    }  # fmt: skip


def test_a_region_at_rest_has_no_multiple(load, tmp_path):
    """Without Poisson's ratio a pull along the bar moves nothing across it."""
    material = (
        'youngs_modulus = "2 GPa"\npoissons_ratio = 0.0\ndensity = "1 g/cm^3"\n'
        'yield_strength = "40 MPa"'
    )
    case = load(
        ('name = "PA12"', material),
        ('"2 x solid"', '"2 x solid", component = "y", load_case = "along"'),
    )
    with pytest.raises(CaseError, match="expected more: state a value in mm") as error:
        gradedesign.run(case, folder=tmp_path / "run")
    for words in ("case.toml:24: limits.displacement[0].magnitude", "'along'", "tip y"):
        assert words in str(error.value)


@pytest.mark.parametrize(
    ("limit", "way"),
    [
        ('{region = "root", magnitude = "1 mm"}', "every direction"),
        ('{region = "root", component = "y", magnitude = "1 mm"}', "in y"),
        ('{region = "root", magnitude = "2 x solid", load_case = "along"}', "every direction"),
    ],
)
def test_a_limit_on_a_held_region_is_refused(cli, load, tmp_path, limit, way):
    load(('{region = "tip", magnitude = "2 x solid"}', limit))
    ended = cli("check", tmp_path)
    assert ended.code == 2
    for words in ("case.toml:21", "limits.displacement[0].region", "'root'", "'along'", way):
        assert words in ended.err


def test_a_region_held_in_one_load_case_only_is_judged_in_the_other(load, tmp_path):
    case = load(
        ('name = "along"\nfix = [{region = "root"}]', 'name = "along"\nfix = [{region = "tip"}]'),
        ('load = [{region = "tip", force = ["200 N", "0 N", "0 N"]}]',
         'load = [{region = "root", force = ["200 N", "0 N", "0 N"]}]'),
    )  # fmt: skip
    result = gradedesign.run(case, folder=tmp_path / "run")
    assert [row.load_case for row in result.solid] == ["down"]
    assert any("is not judged in load case 'along'" in text for text in result.warnings)


def test_a_component_that_supports_leave_free_may_be_limited(load, tmp_path):
    """The root slides in y and z on its face, held at one edge."""
    case = load(
        ('name = "along"\nfix = [{region = "root"}]',
         'name = "along"\nfix = [{region = "root", components = "x"}, '
         '{region = "side", components = "y"}, {region = "under", components = "z"}]'),
        ("[material]",
         '[region.side]\nplane = "y = min"\n[region.under]\nplane = "z = min"\n[material]'),
        ('{region = "tip", magnitude = "2 x solid"}',
         '{region = "root", component = "z", magnitude = "1 mm"}'),
    )  # fmt: skip
    result = gradedesign.run(case, folder=tmp_path / "run")
    assert [row.load_case for row in result.solid] == ["along"]


def test_loads_on_faces_cut_between_the_bricks_of_a_box_are_carried(load, tmp_path):
    # Bricks of 5 mm: the strip from 46 to 60 mm had 7 % too much area and was refused.
    strip = (
        'box = {lower = ["46 mm", "-1 mm", "9 mm"], upper = ["61 mm", "11 mm", "11 mm"]}\n'
        'clip = true\nfacing = "+z"'
    )
    case = load(('[region.tip]\nplane = "x = max"', f"[region.tip]\n{strip}"))
    result = gradedesign.run(case, folder=tmp_path / "run")
    assert result.status == "partial"
