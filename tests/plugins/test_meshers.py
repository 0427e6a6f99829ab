"""A mesher of a plugin end to end: the README's, built, installed and named by a case."""

import json
import os
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from small_parts import held_bar

README = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
TOML = re.findall(r"^```toml\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
(PART,) = (block for block in TOML if "mesher = " in block)
CASE = (
    held_bar(PART.removeprefix("[part]\n"), name="bricks", force="50 N, 0 N, 0 N")
    + """\
[limits]
displacement = [{region = "tip", magnitude = "1 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "4 mm"
density = [0.2, 0.5]
[run]
stop_after = "solid"
[output]
formats = ["report"]
"""
)


@pytest.fixture
def installed(mesher_site, tmp_path, monkeypatch):
    """The README's mesher, as if installed, with a cache of its own."""
    monkeypatch.syspath_prepend(str(mesher_site))
    monkeypatch.setenv("PYTHONPATH", str(mesher_site), prepend=os.pathsep)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield
    sys.modules.pop("gradedesign_acme_mesher", None)


@pytest.mark.usefixtures("undrawn")
def test_a_run_meshes_its_part_with_the_mesher_that_the_case_names(installed, tmp_path, cli):
    assert tomllib.loads(PART)["part"]["mesher"] == "acme-bricks"
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out", "--strict-plugins")
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["status"] == "partial"
    assert "gradedesign-acme-mesher 0.1.0" in result["plugins"]
    # The core's cache holds its mesh, with the one way it was asked in: 12 tetrahedra of two
    # bricks, cut further since their diagonals are longer than 4/3 of 4 mm.
    (entry,) = (tmp_path / "cache").rglob("tetwild/*/*.npz")
    with np.load(entry) as stored:
        (line,) = json.loads(stored["attempts"].tobytes())
        assert line.startswith("as it is: succeeded")
        points = stored["points"]
        assert stored["tets"].shape[1] > 12
    np.testing.assert_allclose([points.min(axis=1), points.max(axis=1)], [[0] * 3, [8, 4, 4]])


def test_an_unknown_mesher_is_refused_with_those_that_are_registered(installed, tmp_path, cli):
    (tmp_path / "case.toml").write_text(CASE.replace("acme-bricks", "acme-brick"), encoding="utf-8")
    wrong = cli("check", tmp_path, "--no-picture")
    assert wrong.code == 2
    assert "case.toml:6: part.mesher: no mesher named 'acme-brick'" in wrong.err
    assert 'did you mean "acme-bricks"? available: acme-bricks, pytetwild' in wrong.err


@pytest.mark.usefixtures("undrawn")
def test_a_mesher_that_fails_is_told_as_one(installed, tmp_path, cli, mesher_site, monkeypatch):
    text = (mesher_site / "gradedesign_acme_mesher.py").read_text(encoding="utf-8")
    broken = tmp_path / "broken"
    broken.mkdir()
    text = text.replace("return points, np.concatenate(tets)", "return points, tets[0]")
    (broken / "gradedesign_acme_mesher.py").write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(broken), prepend=os.pathsep)
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    wrong = cli("run", tmp_path, "-o", tmp_path / "out")
    assert wrong.code == 6
    assert "attempts with the same tolerance: 1; attempt 1: as it is: " in wrong.err
    assert "volume" in wrong.err
