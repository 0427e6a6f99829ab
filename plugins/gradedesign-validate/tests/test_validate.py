"""The regression suite's own logic: choosing cases, comparing, updating."""

import json
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gradedesign.errors import MeshError
from gradedesign_validate import run_validate as module
from gradedesign_validate.expected_values import compare, value_at
from gradedesign_validate.suite_cases import matches

DATA = {
    "status": "met",
    "reason": "fine",
    "lightest": True,
    "mass_g": 10.04,
    "limits": ({"utilisation": 0.98}, {"utilisation": 0.5}),
    "iterations": ({"discrepancy": (0.01, 0.02)}, {"discrepancy": (0.03,)}),
}

EXPECTED = """\
# Why these numbers.
[status]
value = "met"
origin = "the design"

[mass_g]
value = 10.0        # g
tolerance = 0.01
origin = "value = 9 in [an older] commit"
from_run = true

["iterations.-1.discrepancy.0"]
value = 0.03
at_most = 0.05
origin = "acceptance criterion"
"""


@pytest.fixture
def suite(tmp_path, monkeypatch):
    """Two case folders whose runs are canned."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "case.toml").write_text("")
        (tmp_path / name / "expected.toml").write_text(EXPECTED, encoding="utf-8")
    (tmp_path / "no-expectations").mkdir()
    (tmp_path / "no-expectations" / "case.toml").write_text("")
    results = {"one": dict(DATA), "two": dict(DATA)}
    monkeypatch.setattr(module, "run_data", lambda folder, *_, **__: results[folder.name])
    return tmp_path, results


def test_continuous_integration_reads_what_deviates(cli, suite, tmp_path):
    folder, results = suite
    results["two"]["mass_g"] = 11.0
    file = tmp_path / "suite.xml"
    assert cli("validate", folder, "--junit", file).code == 1
    one, two = ElementTree.parse(file).getroot()
    assert [(s.get("name"), s.get("tests"), s.get("failures")) for s in (one, two)] == [
        ("one", "3", "0"),
        ("two", "3", "1"),
    ]
    assert float(two.get("time")) >= 0.0
    (failed,) = [test for test in two if len(test)]
    assert failed.get("name") == "mass_g"
    assert failed[0].get("message") == "found 11, expected 10 (9.9 to 10.1)"
    assert failed[0].text == "value = 9 in [an older] commit"


STATED = """\
[case]
name = "block"
[part]
box = ["6 mm", "6 mm", "6 mm"]
[material]
name = "Ti-6Al-4V"
[lattice]
cell = "gyroid-sheet"
size = "6 mm"
density = 0.35
[run]
memory = "2 GB"
[output]
formats = ["stl"]
"""
BLOCK = """\
[mass_g]
value = 0.3334
tolerance = 0.0025
origin = "6^3 mm^3 of 4.41 g/cm^3 at a density of 0.35"
"""


def test_cases_in_processes_write_a_history_that_tells_what_changed(cli, tmp_path):
    """Found at any depth; a case is left out only while it and the program are what passed."""
    for folder in ("a/b/block", "brick"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "case.toml").write_text(STATED)
        (tmp_path / folder / "expected.toml").write_text(BLOCK)
    history = tmp_path / "history.jsonl"
    options = ("--jobs", 2, "--history", history, "--changed")
    assert cli("validate", tmp_path, *options).code == 0
    lines = [json.loads(text) for text in history.read_text().splitlines()]
    assert {line["case"] for line in lines} == {"block", "brick"}
    for line in lines:
        assert line["passed"]
        assert line["mass_g"] == pytest.approx(0.3334, rel=0.02)
        assert line["values"] == {"mass_g": line["mass_g"]}
        assert 50e6 < line["peak_bytes"] < 2e9
    assert (tmp_path / "history-block.png").read_bytes().startswith(b"\x89PNG")
    assert "0 of 2 cases changed" in cli("validate", tmp_path, *options).out
    (tmp_path / "brick" / "case.toml").write_text(STATED.replace("0.35", "0.4"))
    ended = cli("validate", tmp_path, *options)
    assert ended.code == 1
    assert "1 of 2 cases changed" in ended.out
    (moved,) = [row for row in ended.out.split("Moved against")[1].splitlines() if "mass_g" in row]
    assert moved.split()[0] == "brick"
    assert float(moved.split()[-2]) == pytest.approx(14.3, abs=2.0)


def test_a_case_that_holds_more_than_its_memory_is_ended(cli, tmp_path):
    (tmp_path / "case.toml").write_text(STATED.replace("2 GB", "100 MB"))
    (tmp_path / "expected.toml").write_text(BLOCK)
    ended = cli("validate", tmp_path, "--jobs", 1)
    assert ended.code == 1
    assert "more than its run.memory of 0.10 GB" in " ".join(ended.out.split())


def test_two_cases_of_one_name_and_a_damaged_history_are_refused(cli, suite, tmp_path):
    folder, _ = suite
    (folder / "x" / "one").mkdir(parents=True)
    for name in ("case.toml", "expected.toml"):
        (folder / "x" / "one" / name).write_text((folder / "one" / name).read_text())
    assert "have one name" in cli("validate", folder).err
    (tmp_path / "h.jsonl").write_text("nonsense\n")
    ended = cli("validate", folder / "one", "--history", tmp_path / "h.jsonl")
    assert (ended.code, "line 1 is none of a history" in ended.err) == (2, True)
    assert cli("validate", folder / "one", "--changed").code == 2


def test_a_case_that_is_named_is_run_without_those_below_it(cli, suite):
    """Else the process of a case would answer for two."""
    folder, _ = suite
    (folder / "two").rename(folder / "one" / "two")
    count = cli("validate", folder / "one" / "two").out.count(" ok ")
    assert count > 0
    assert cli("validate", folder / "one").out.count(" ok ") == count
    assert cli("validate", folder).out.count(" ok ") == 2 * count


def test_everything_as_expected(cli, suite):
    folder, _ = suite
    ended = cli("validate", folder)
    assert ended.code == 0
    assert ended.out.count(" ok ") == 6
    assert "9.9 to" in ended.out
    assert {"acceptance", "criterion"} <= set(ended.out.split())  # wrapped in its column


def test_it_shows_progress():
    assert "ProgressLines(" in Path(module.__file__).read_text(encoding="utf-8")


def test_a_deviation_ends_with_1_and_is_shown(cli, suite):
    folder, results = suite
    results["two"]["mass_g"] = 10.2
    ended = cli("validate", folder, "--json")
    assert ended.code == 1
    (wrong,) = [c for c in json.loads(ended.out) if not c["passed"]]
    assert (wrong["case"], wrong["quantity"], wrong["value"]) == ("two", "mass_g", 10.2)
    assert wrong["origin"]
    assert cli("validate", folder / "one").code == 0
    assert cli("validate", folder, "-k", "not two").code == 0
    assert "DEVIATES" in cli("validate", folder, "-k", "two").out


def test_update_writes_new_values_and_keeps_the_rest(cli, suite):
    folder, results = suite
    # The discrepancy differs by less than is written.
    results["one"] |= {"mass_g": 12.3456789, "iterations": ({"discrepancy": (0.03 + 1e-12,)},)}
    ended = cli("validate", folder / "one", "--update")
    assert "mass_g 10.0 -> 12.3457; is its origin still" in " ".join(ended.out.split())
    assert "stays" not in ended.out
    text = (folder / "one" / "expected.toml").read_text(encoding="utf-8")
    assert text == EXPECTED.replace("10.0 ", "12.3457 ")
    assert tomllib.loads(text)["mass_g"]["value"] == 12.3457
    assert cli("validate", folder / "one").code == 0


def test_update_leaves_what_is_no_run_of_its_own_and_says_so(cli, suite):
    """A verdict, a formula, a bar: the program is measured by them."""
    folder, results = suite
    results["one"] |= {"mass_g": 12.3456789, "status": "not_met"}
    ended = cli("validate", folder / "one", "--update")
    said = " ".join(ended.out.split())
    assert (
        'status stays "met", found not_met: no from_run = true, its origin is "the design"' in said
    )
    text = (folder / "one" / "expected.toml").read_text(encoding="utf-8")
    assert text == EXPECTED.replace("10.0 ", "12.3457 ")
    assert cli("validate", folder / "one").code == 1


def test_a_failed_run_deviates_and_is_never_made_the_expectation(cli, suite):
    folder, results = suite
    results["one"] = {"status": "failed", "reason": "mesher gone", "exit_code": 6}
    ended = cli("validate", folder / "one", "--update")
    assert ended.code == 1
    assert "mesher gone" in ended.out
    assert (folder / "one" / "expected.toml").read_text(encoding="utf-8") == EXPECTED


def test_an_error_of_a_case_is_its_result(tmp_path, monkeypatch):
    def fail(*args, **options):
        raise MeshError("no mesh")

    monkeypatch.setattr(module, "load_case", fail)
    assert module.run_data(tmp_path, None) == {
        "status": "failed",
        "reason": "no mesh",
        "exit_code": 6,
    }


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("[mass_g]\nvalue = 1.0\ntolerance = 0.1", "lacks origin"),
        ("[mass_g]\ntolerance = 0.1\norigin = 'x'", "lacks value"),
        ("[mass_g]\nvalue = 1.0\norigin = 'x'", "how far"),
        ("[mass_g]\nvalue = 1.0\ntolerance = 0.1\norigin = 'x'\nfrom_run = 1", "from_run"),
        ("mass_g = 1.0", "not a table"),
        ("mass_g = ", "expected.toml"),
    ],
)
def test_careless_expectations_are_refused(cli, suite, entry, words):
    folder, _ = suite
    (folder / "one" / "expected.toml").write_text(entry, encoding="utf-8")
    ended = cli("validate", folder / "one")
    assert ended.code == 2
    assert words in ended.err


def test_nothing_to_validate_is_an_error(cli, suite):
    folder, _ = suite
    ended = cli("validate", folder, "-k", "three")
    assert ended.code == 2
    assert "found: one, two" in ended.err


@pytest.mark.parametrize(
    ("expression", "chosen"),
    [
        ("", "mini bracket infeasible"),
        ("mini", "mini"),
        ("mini or bracket", "mini bracket"),
        ("not mini", "bracket infeasible"),
        ("in and not feasible", "mini"),
    ],
)
def test_expressions(expression, chosen):
    names = ["mini", "bracket", "infeasible"]
    assert [n for n in names if matches(n, expression)] == chosen.split()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass_g", 10.04),
        ("limits.1.utilisation", 0.5),
        ("iterations.-1.discrepancy.0", 0.03),
        ("iterations.7.discrepancy", None),
        ("iterations.-3.discrepancy", None),
        ("iterations.x", None),
        ("mass_g.x", None),
        ("absent", None),
    ],
)
def test_values_by_name(name, value):
    assert value_at(DATA, name) == value


@pytest.mark.parametrize(
    ("spec", "passed"),
    [
        ({"value": 10.0, "tolerance": 0.005}, True),
        ({"value": 10.0, "tolerance": 0.003}, False),
        ({"value": 10.0, "at_most": 10.04}, True),
        ({"value": 10.0, "at_most": 10.03}, False),
        ({"value": 10.0, "at_least": 10.05}, False),
        ({"value": 10.0, "tolerance": 0.1, "at_least": 10.05}, False),
    ],
)
def test_bounds(spec, passed):
    assert compare("c", "mass_g", {**spec, "origin": "x"}, DATA).passed is passed


def test_text_and_truth_are_compared_as_they_are():
    assert compare("c", "status", {"value": "met", "origin": "x"}, DATA).passed
    assert not compare("c", "lightest", {"value": False, "origin": "x"}, DATA).passed
