"""`gradedesign new`: a case whose regions select what they say, and which asks for the rest."""

import importlib.util
import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from gradedesign.design.check.draft_case import draft_case
from gradedesign.design.check.draft_text import draft_text, open_questions
from gradedesign.geometry.part.file_faces import FileFaces
from gradedesign.geometry.part.raw_triangles import RawTriangles
from gradedesign.program.host.registry import build_registry

ROOT = Path(__file__).parents[2]
BRACKET = ROOT / "cases" / "bracket" / "bracket.stl"

#: What the bracket's user knows, in the order of the file.
KNOWN = {
    'name = "?"': 'name = "Ti-6Al-4V"',
    'fix = [{region = "?"}]': 'fix = [{region = "hole_9_z"}]',
    'load = [{region = "?", force = ["? N", "? N", "? N"]}]': (
        'load = [{region = "hole_12_y", force = ["500 N", "0 N", "1200 N"]}]'
    ),
    'safety_factor = "?"': "safety_factor = 2",
    'cell = "?"': 'cell = "gyroid-sheet"',
}


def filled(text):
    """The text of a new case, with the bracket's supports, loads and limits."""
    for asked, known in KNOWN.items():
        assert text.count(f"\n{asked}") == 1
        text = text.replace(f"\n{asked}", f"\n{known}")
    return text


@pytest.mark.usefixtures("drawn")
def test_a_new_case_needs_nothing_but_what_stands_as_a_question(cli, tmp_path):
    folder = tmp_path / "bracket"
    ended = cli("new", BRACKET, "--units", "mm", "-o", folder)
    assert ended.code == 0
    assert {path.name for path in folder.iterdir()} == {"bracket.stl", "case.toml", "regions.png"}
    assert (folder / "bracket.stl").read_bytes() == BRACKET.read_bytes()
    case_file = folder / "case.toml"
    case_file.write_text(filled(case_file.read_text(encoding="utf-8")), encoding="utf-8")
    ended = cli("check", folder, "--json", "--no-picture")
    assert ended.code == 0
    checked = json.loads(ended.out)
    # Bolts of 9 mm in spot faces of 16 mm, the lug's 12 mm, an inner rounding of 24 mm.
    faces = {region["name"]: region["faces"] for region in checked["regions"]}
    assert faces["hole_9_z"] == 4
    assert faces["hole_12_y"] == 1
    assert faces["hole_16_z"] == 4
    # The eye of the lug has 24 mm as well, so that this one is told by a point of its axis.
    assert faces["hole_24_y"] == 1
    assert {"x_min", "x_max", "y_min", "y_max", "z_min"} <= set(faces)


def test_one_of_several_faces_is_taken_as_the_file_says(cli, tmp_path):
    folder = tmp_path / "bracket"
    cli("new", BRACKET, "--units", "mm", "-o", folder)
    text = (folder / "case.toml").read_text(encoding="utf-8")
    block = text[text.index("[region.hole_9_z]") :].split("\n\n")[0]
    point = block[block.index("# nearest = ") + 2 :].split(" with count = 1")[0]
    one = block[: block.index("#")].replace("count = 4", f"count = 1\n{point}")
    (folder / "case.toml").write_text(filled(text.replace(block, one)), encoding="utf-8")
    checked = json.loads(cli("check", folder, "--json", "--no-picture").out)
    (bolt,) = (region for region in checked["regions"] if region["name"] == "hole_9_z")
    assert bolt["faces"] == 1
    stated = [float(x.split()[0]) for x in tomllib.loads(one)["region"]["hole_9_z"]["nearest"]]
    np.testing.assert_allclose(bolt["centroid_mm"][:2], stated[:2], atol=0.1)


def test_every_gap_is_named_with_its_line(cli, tmp_path):
    folder = tmp_path / "bracket"
    cli("new", BRACKET, "--units", "mm", "-o", folder)
    lines = (folder / "case.toml").read_text(encoding="utf-8").splitlines()
    ended = cli("check", folder)
    assert ended.code == 2
    for key, text in (
        ("load_case[0].fix[0].region", "fix ="),
        ("load_case[0].load[0].force", "load ="),
        ("limits.safety_factor", "safety_factor ="),
    ):
        line = 1 + next(i for i, row in enumerate(lines) if row.startswith(text))
        assert f"case.toml:{line}: {key}" in ended.err


def test_new_names_every_gap_that_is_left(cli, tmp_path):
    folder = tmp_path / "bracket"
    ended = cli("new", BRACKET, "--units", "mm", "-o", folder)
    text = (folder / "case.toml").read_text(encoding="utf-8")
    asked = open_questions(text)
    rows = text.splitlines()
    # The three components of a force are one row; the file's first line speaks of "?" itself.
    left = [
        (line, row.count('"?') - 2 * row.count("? N") // 3)
        for line, row in enumerate(rows, start=1)
        if '"?' in row and line > 1
    ]
    assert sum(count for _, count in left) == len(asked)
    assert [line for line, _ in left] == sorted({question.line for question in asked})
    words = " ".join(ended.out.split())
    for question in asked:
        assert f"{question.line} {question.key} {question.expected}" in words
    # What is written as it says there is a case.
    assert {question.key for question in asked if not rows[question.line - 1].startswith("#")} == {
        "material.name", "load_case[0].fix[0].region", "load_case[0].load[0].region",
        "load_case[0].load[0].force", "limits.safety_factor", "lattice.cell",
    }  # fmt: skip


def test_a_dry_run_says_the_same_and_writes_nothing(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    looked = cli("new", BRACKET, "--units", "mm", "--dry-run")
    assert (looked.code, list(tmp_path.iterdir())) == (0, [])
    data = json.loads(cli("new", BRACKET, "--units", "mm", "--dry-run", "--json").out)
    assert (data["case"], data["picture"], list(tmp_path.iterdir())) == (None, None, [])
    written = cli("new", BRACKET, "--units", "mm", "--json")
    again = json.loads(written.out)
    assert {**again, "case": None, "picture": None} == data
    assert again["case"] == "bracket/case.toml"
    assert Path(again["case"]).read_text(encoding="utf-8") == data["text"]
    # A dry run shows what `new` shows above its files.
    shown = cli("new", BRACKET, "--units", "mm", "-o", "other").out
    assert shown.startswith(looked.out)
    # Each region by the lines that select it, in the order of their names.
    names = [region["name"] for region in data["regions"]]
    assert names == sorted(tomllib.loads(data["text"])["region"])
    (bolts,) = (region for region in data["regions"] if region["name"] == "hole_9_z")
    assert bolts["faces"] == 4
    assert bolts["lines"] in data["text"]
    assert data["part"]["size_mm"] == pytest.approx([112, 46, 92])
    assert {q["key"] for q in data["open_questions"]} >= {"material.name", "lattice.cell"}


def test_a_file_without_a_unit_is_asked_for_one(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = cli("new", BRACKET)
    assert ended.code == 2
    assert "its box is 112 x 46 x 92" in ended.err
    assert "--units inch" in ended.err
    assert list(tmp_path.iterdir()) == []
    ended = cli("new", BRACKET, "--units", "inches")
    assert 'did you mean "inch"?' in ended.err


def test_nothing_is_overwritten(cli, tmp_path):
    folder = tmp_path / "bracket"
    folder.mkdir()
    (folder / "case.toml").write_text("mine", encoding="utf-8")
    ended = cli("new", BRACKET, "--units", "mm", "-o", folder)
    assert (ended.code, (folder / "case.toml").read_text(encoding="utf-8")) == (2, "mine")
    (folder / "case.toml").unlink()
    (folder / "regions.png").write_bytes(b"mine")
    assert "regions.png is there already" in cli("new", BRACKET, "--units", "mm", "-o", folder).err
    (folder / "regions.png").unlink()
    (folder / "bracket.stl").write_bytes(b"another")
    ended = cli("new", BRACKET, "--units", "mm", "-o", folder)
    assert "is another file" in ended.err
    assert (folder / "bracket.stl").read_bytes() == b"another"


def test_a_part_stays_where_its_case_is_written(cli, tmp_path):
    shutil.copy(BRACKET, tmp_path)
    assert cli("new", tmp_path / BRACKET.name, "--units", "mm", "-o", tmp_path).code == 0
    assert (tmp_path / "case.toml").is_file()


def test_a_link_is_copied_as_the_part_that_it_leads_to(cli, tmp_path):
    link = tmp_path / "link.stl"
    link.symlink_to(BRACKET)
    assert cli("new", link, "--units", "mm", "-o", tmp_path / "case").code == 0
    copy = tmp_path / "case" / "link.stl"
    assert not copy.is_symlink()
    assert copy.read_bytes() == BRACKET.read_bytes()


def test_names_of_faces_that_no_case_can_state_are_left_out(tmp_path, monkeypatch):
    """A name too long for a case, one of another script, and two that give one name of a region."""
    names = {1: "n" * 200, 2: "ナット", 3: "Lug A", 4: "lug-a"}
    corners = trimesh.creation.box((30.0, 20.0, 10.0)).triangles
    planes = np.argmax(np.abs(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1))), axis=1)
    side = 2 * planes + (corners.mean(axis=1)[np.arange(12), planes] > 0)

    def read(path):
        return RawTriangles(corners=corners, unit="mm", faces=FileFaces(label=side, names=names))

    registry = build_registry()
    reader = replace(registry.readers["stl"], read=read)
    registry = replace(registry, readers={**registry.readers, "stl": reader})
    (tmp_path / "box.stl").write_bytes(b"")
    draft = draft_case(tmp_path / "box.stl", registry)
    assert {"face", "lug_a", "lug_a_2"} <= set(draft.regions)
    data = tomllib.loads(draft_text(draft, "box", "box.stl"))
    assert data["region"]["face"] == {"name": "ナット"}
    assert data["region"]["lug_a_2"] == {"name": "lug-a"}
    assert not [key for key in draft.regions if key.startswith("nnn")]


def test_damage_that_needs_a_choice_is_repaired_when_it_is_asked_for(cli, tmp_path):
    part = tmp_path / "open.stl"
    box = trimesh.creation.box((30.0, 20.0, 10.0)).subdivide().subdivide().subdivide()
    box.update_faces(np.arange(len(box.faces)) != 5)
    box.export(part)
    ended = cli("new", part, "--units", "mm", "-o", tmp_path / "case")
    assert ended.code == 3
    assert 'repair = "auto"' in ended.err
    assert not (tmp_path / "case").exists()
    ended = cli("new", part, "--units", "mm", "--repair", "auto", "-o", tmp_path / "case")
    assert ended.code == 0
    assert "holes_filled 1" in ended.out
    data = tomllib.loads((tmp_path / "case" / "case.toml").read_text(encoding="utf-8"))
    assert data["part"]["repair"] == "auto"
    ended = cli("new", part, "--units", "mm", "--repair", "autp", "-o", tmp_path / "other")
    assert 'did you mean "auto"?' in ended.err


def test_names_that_toml_must_escape(cli, tmp_path):
    part = tmp_path / 'lever "A" & <b> \\ 7.stl'
    trimesh.creation.box((30.0, 20.0, 10.0)).export(part)
    assert cli("new", part, "--units", "cm", "-o", tmp_path / "case").code == 0
    data = tomllib.loads((tmp_path / "case" / "case.toml").read_text(encoding="utf-8"))
    assert data["case"]["name"] == part.stem
    assert data["part"] == {"file": part.name, "units": "cm"}
    assert {key: region["plane"] for key, region in data["region"].items()} == {
        f"{axis}_{side}": f"{axis} = {side}" for axis in "xyz" for side in ("min", "max")
    }
    # 4 V / A = 4 * 6000 / 2200 = 10.9 mm between the faces in the mean, times ten for cm, halved.
    assert data["lattice"]["size"] == "55 mm"


def test_a_part_without_flat_or_round_faces_has_no_regions(cli, tmp_path):
    part = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=4, radius=10.0).export(part)
    ended = cli("new", part, "--units", "mm", "-o", tmp_path / "ball")
    assert ended.code == 0
    data = tomllib.loads((tmp_path / "ball" / "case.toml").read_text(encoding="utf-8"))
    assert "region" not in data


@pytest.mark.skipif(importlib.util.find_spec("OCP") is None, reason="needs gradedesign-step")
def test_names_of_a_cad_file_become_regions(cli, tmp_path):
    lever = ROOT / "cases" / "step-part" / "lever.step"
    ended = cli("new", lever, "-o", tmp_path / "lever")
    assert ended.code == 0, ended.err
    # A bore with a name in the file is a hole, as one without.
    assert re.search(r"hub +1 +10 +z ", ended.out)
    assert "hole" not in ended.out.partition("Holes, slots")[2].partition("Faces of")[0]
    data = tomllib.loads((tmp_path / "lever" / "case.toml").read_text(encoding="utf-8"))
    assert data["part"] == {"file": "lever.step"}
    assert data["region"]["hub"] == {"name": "hub"}
    assert data["region"]["pin"] == {"name": "pin"}


def test_a_scan_is_refused_by_name(cli, tmp_path):
    scan = tmp_path / "scan.npy"
    np.save(scan, np.ones((4, 4, 4)))
    ended = cli("new", scan, "-o", tmp_path / "case")
    assert ended.code == 2
    assert "[part.voxels]" in ended.err
    assert not (tmp_path / "case").exists()


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_part_in_place_of_a_case_is_told_of_the_way(cli, tmp_path, command):
    binary, text = BRACKET, tmp_path / "text.stl"
    trimesh.creation.box((3.0, 2.0, 1.0)).export(text, file_type="stl_ascii")
    for part in (binary, text):
        ended = cli(command, part)
        assert ended.code == 2
        assert f"is {part.name} the file of a part? `gradedesign new` begins" in ended.err
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("a = ", encoding="utf-8")
    assert "gradedesign new" not in cli(command, wrong).err
