"""docs/result.md beside what is written: every key is documented, and what is documented exists."""

import ast
import hashlib
import json
from dataclasses import fields
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from result_keys import documented, undocumented
from small_parts import SHORT_BAR

import gradedesign
from gradedesign.design.acceptance.body import Body
from gradedesign.design.acceptance.body_comparison import BodyComparison
from gradedesign.design.check.price import PricedBody
from gradedesign.design.loop.iteration_row import Iteration, LimitIteration
from gradedesign.design.loop.predicted_cost import CostPrediction
from gradedesign.design.verdict.result import RunResult
from gradedesign.mechanics.explicit.measures import StressMeasure
from gradedesign.mechanics.limits.banded import Banded
from gradedesign.mechanics.limits.key import LimitKey
from gradedesign.mechanics.limits.row import LimitRow

SOURCES = Path(gradedesign.__file__).parent.rglob("*.py")
CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
temperature_change = "5 K"
[limits]
stress = "200 MPa"
displacement = [{region = "tip", magnitude = "0.05 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = [0.4, 0.7]
size_effects = false
[run]
stop_after = "solid"
[output]
formats = ["report"]
"""
)


def test_top_level_keys_are_those_of_the_page():
    page = {path.split(".")[0].split("[")[0] for path in documented()}
    assert page == {field.name for field in fields(RunResult)}


@pytest.mark.parametrize(
    ("place", "record", "more"),
    [
        ("limits[]", LimitRow, {"decisive", "utilisation", "passed"}),
        ("limits[].key", LimitKey, set()),
        ("limits[].band", Banded, set()),
        ("bodies[]", PricedBody, set()),
        ("iterations[]", Iteration, set()),
        ("iterations[].limits[]", LimitIteration, set()),
        ("measures.<load case>.<phase>", StressMeasure, set()),
        ("printed.comparison", BodyComparison, {"volume_difference", "contour_loss"}),
        ("printed.comparison.printed", Body, set()),
        ("predicted.at_start", CostPrediction, set()),
    ],
)
def test_records_are_documented_field_by_field(place, record, more):
    below = [path.removeprefix(place + ".") for path in documented() if path.startswith(place)]
    names = {path.split(".")[0].split("[")[0] for path in below}
    assert names == {field.name for field in fields(record)} | more


def test_no_documented_key_is_unknown_to_the_code():
    known = set()
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                known.add(node.value)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                known.add(node.target.id)
    steps = {
        step.removesuffix("[]")
        for path in documented()
        for step in path.split(".")
        if step != "*" and not step.startswith("<")
    }
    assert steps - known == set()


def test_a_result_says_where_it_comes_from(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    case = gradedesign.load_case(tmp_path)
    result = gradedesign.run(case, folder=tmp_path / "run")
    data = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert undocumented(data) == []
    wrong = {**data, "drains": [], "limits": [{"worth": 1}], "measures": {"holes": []}}
    assert undocumented(wrong) == ["limits[].worth", "measures.holes", "drains"]
    age = datetime.now(UTC) - datetime.fromisoformat(data["date"])
    assert timedelta(0) <= age < timedelta(minutes=5)
    assert data["version"] == data["versions"]["gradedesign"]
    # Library: 110 GPa, 0.34, 4.41 g/cm^3, 825 MPa.
    numbers = {name: data["material"][name] for name in (
        "youngs_modulus_MPa", "poissons_ratio", "density_g_cm3", "yield_strength_MPa")}  # fmt: skip
    assert list(numbers.values()) == [110000.0, 0.34, 4.41, 825.0]
    (load_case,) = data["load_cases"]
    (support,), (load,) = load_case["supports"], load_case["loads"]
    assert (support["region"], support["displacement_mm"]) == ("root", [0.0, 0.0, 0.0])
    assert (load["on"], load["force_N"]) == ("tip", [0.0, 0.0, -100.0])
    assert load_case["temperature_change_K"] == 5.0
    report = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    for words in (
        result.date[:16].replace("T", " "),
        "110000",
        "0.34",
        "4.41",
        "825",
        "0, 0, -100",
        "+5 K",
    ):
        assert words in report
    # Resuming keeps the date, and a later run of the same case has the same hash.
    again = gradedesign.run(case, folder=tmp_path / "run", resume=True)
    assert (again.date, again.checksums) == (result.date, result.checksums)
    assert gradedesign.load_case(tmp_path).case_hash == data["case_hash"]


def test_checksums_are_those_of_the_files(cli, tmp_path):
    from gradedesign.geometry.formats.write_stl import write_stl
    from gradedesign.geometry.part.box import box_surface

    write_stl(tmp_path / "block.stl", box_surface((8.0, 8.0, 8.0)))
    (tmp_path / "case.toml").write_text(
        """\
[case]
name = "block"
[part]
file = "block.stl"
units = "mm"
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
density = 0.3
[print]
overhang_angle = "40 deg"
[output]
formats = ["stl"]
""",
        encoding="utf-8",
    )
    done = cli("run", tmp_path, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    data = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert undocumented(data) == []
    files = {"part": tmp_path / "block.stl", "print": tmp_path / "out" / "lattice.stl"}
    assert data["checksums"] == {
        what: {path.name: hashlib.sha256(path.read_bytes()).hexdigest()}
        for what, path in files.items()
    }
