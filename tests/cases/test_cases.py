"""The case folders: complete, and each runs to what its expected.toml says."""

import importlib.util
import json
import tomllib
from pathlib import Path

import pytest

import gradedesign
from gradedesign_validate.expected_values import read_expected

ROOT = Path(__file__).parents[2]
PARTS = ROOT.parent / "shared" / "parts"
FOLDERS = sorted(p.parent for p in (ROOT / "cases").glob("*/case.toml"))
WITH_EXPECTATIONS = [p for p in FOLDERS if (p / "expected.toml").is_file()]

#: Minutes each: only ``make test-all`` runs them.
SLOW = {
    "bone-scaffold",
    "bracket",
    "cantilever-compact",
    "clevis",
    "compression-block",
    "engine-bracket",
    "heat-sink",
    "hollow-sphere",
    "knot",
    "mbb-beam",
    "mini-open",
    "ramirez-cantilever",
    "ramirez-primitive",
    "ramirez-whole",
    "size-graded",
    "step-part",
    "two-zones",
}


def marked(folder):
    marks = [pytest.mark.slow, pytest.mark.timeout(3600)] if folder.name in SLOW else []
    if folder.name == "step-part" and importlib.util.find_spec("OCP") is None:
        marks.append(pytest.mark.skip(reason="cadquery-ocp-novtk is not installed"))
    return pytest.param(folder, marks=marks, id=folder.name)


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize("folder", [marked(p) for p in WITH_EXPECTATIONS])
def test_case_runs_as_expected(cli, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = cli("validate", folder, "--json")
    comparisons = json.loads(ended.out)
    deviating = [c for c in comparisons if not c["passed"]]
    assert deviating == []
    assert ended.code == 0
    assert {c["quantity"] for c in comparisons} >= {"status"}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda p: p.name)
def test_case_is_read_and_bears_the_name_of_its_folder(folder):
    case = gradedesign.load_case(folder)
    assert case.name == folder.name


@pytest.mark.parametrize("folder", WITH_EXPECTATIONS, ids=lambda p: p.name)
def test_case_folder_is_complete(folder):
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert len(readme.splitlines()) >= 10
    pictures = [part.split(")")[0] for part in readme.split("](")[1:]]
    pictures = [name for name in pictures if name.endswith(".png")]
    assert pictures
    for name in pictures:
        data = (folder / name).read_bytes()
        assert data.startswith(b"\x89PNG")
    expected = read_expected(folder / "expected.toml")
    assert "status" in expected
    assert all(len(spec["origin"]) > 10 for spec in expected.values())


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_bracket_weighs_at_most_eight_tenths_of_its_best_uniform_lattice(tmp_path):
    # at most 0.80 of the lattice's mass: bar of the project, 0.64 to 0.74 on homogenised trials
    bracket = ROOT / "cases" / "bracket"
    (tmp_path / "bracket.stl").write_bytes((bracket / "bracket.stl").read_bytes())
    text = (bracket / "case.toml").read_text(encoding="utf-8")
    assert 'grading = "level"' in text
    (tmp_path / "case.toml").write_text(
        text.replace('grading = "level"', 'grading = "uniform"'), encoding="utf-8"
    )
    uniform = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    assert (uniform.status, uniform.lightest) == ("met", True)
    graded = read_expected(bracket / "expected.toml")["lattice_mass_g"]
    heaviest = graded["value"] * (1 + graded["tolerance"])
    # A limit used to at least 97 % holds the lightest within 2 % of the mass.
    assert heaviest <= 0.80 * uniform.lattice_mass_g


ARCH = """
[lattice.cell_map]
kind = "cylindrical"
axis = "+y"
centre = ["12 mm", "0 mm", "-30 mm"]
inner_radius = "30 mm"
around = 19

[run]"""


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_cells_about_an_axis_go_through_the_loop(tmp_path):
    # The homogenised part is taught the rest: 2 % in displacement is the bar of the project.
    text = (ROOT / "cases" / "mini" / "case.toml").read_text(encoding="utf-8")
    (tmp_path / "case.toml").write_text(text.replace("\n[run]", ARCH), encoding="utf-8")
    result = gradedesign.run(gradedesign.load_case(tmp_path), folder=tmp_path / "run")
    assert (result.status, result.lightest) == ("met", True)
    assert abs(result.iterations[-1].limits[0].discrepancy) <= 0.02
    cells = result.measures["cell_map"]
    # By hand: a sector is 2 pi r / 19 wide, the part lies at radii of 30 to hypot(12, 42) mm.
    assert cells["name"] == "cylindrical"
    assert cells["size_by_axis"][1]["least"] == pytest.approx(2 * 3.14159 * 30 / 19, rel=0.02)
    assert cells["size_by_axis"][1]["most"] == pytest.approx(2 * 3.14159 * 43.7 / 19, rel=0.02)


FEATURETYPE = """
[case]
name = "featuretype"
[part]
file = "featuretype.STL"
units = "inch"
mesh_size = "6 mm"
[region.base]
plane = "y = min"
[region.top]
plane = "y = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "base"
margin = "2 mm"
[[keep]]
region = "top"
margin = "2 mm"
[[load_case]]
name = "press"
fix = [{region = "base"}]
load = [{region = "top", force = ["0 N", "-2 kN", "0 N"]}]
[limits]
safety_factor = 2
[lattice]
cell = "gyroid-network"
size = "20 mm"
density = [0.25, 0.60]
[run]
time = "20 min"
acceptance = "submodels"
submodel_count = 1
"""


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not PARTS.is_dir(), reason="the parts are not beside this checkout")
def test_a_part_in_inches_goes_through_the_loop(cli, tmp_path):
    (tmp_path / "featuretype.STL").write_bytes((PARTS / "featuretype.STL").read_bytes())
    (tmp_path / "case.toml").write_text(FEATURETYPE, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "run")
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert ended.code == 0, ended.err + result["reason"]
    assert result["status"] == "met"
    assert result["acceptance"]["scope"] == "submodels"
    assert result["mass_g"] < result["solid_mass_g"]


def test_the_study_of_families_holds_every_cubic_family_with_a_law(cli):
    folder = ROOT / "cases" / "ramirez-cantilever"
    study = tomllib.loads((folder / "study.toml").read_text(encoding="utf-8"))
    listed = {
        cell["name"]
        for cell in json.loads(cli("cells", "--json").out)
        if cell["symmetry"] == "cubic" and cell["laws"]
    }
    assert set(study["vary"]["lattice.cell"]) == listed
    case = gradedesign.load_case(folder / study["study"]["case"])
    assert case.name == "ramirez-families"


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_finer_meshes_of_the_part_need_the_same_mass(cli, tmp_path):
    """From the edge that is the default here, 45 mm, on: within 2 %, the band that a verdict has.

    100 mm is not fine enough for that.
    """
    study = ROOT / "cases" / "ramirez-cantilever" / "mesh.toml"
    ended = cli("sweep", study, "-o", tmp_path / "out", "--workers", "1")
    assert ended.code == 0
    table = json.loads((tmp_path / "out" / "table.json").read_text(encoding="utf-8"))
    masses = {
        float(row["values"]["part.mesh_size"].removesuffix(" mm")): row["mass_g"]
        for row in table["designs"]
    }
    finest = masses.pop(min(masses))
    assert all(
        mass == pytest.approx(finest, rel=0.02) for size, mass in masses.items() if size < 45
    )
    assert masses[100] > 1.02 * finest
