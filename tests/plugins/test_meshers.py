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


#: Pytetwild, but for the first two meshes it is asked for: these lack 1.26 % of their volume.
MISSING = """
import os
from pathlib import Path
import numpy as np
from gradedesign import Mesher, hookimpl, serve_mesher


def mesh(vertices, faces, options):
    from gradedesign.geometry.tets import _tetwild_worker

    more = {"threads": 1, "simplify": True}
    points, tets = _tetwild_worker.mesh_surface(vertices, faces, {**options, **more})
    asked = Path(os.environ["FAKE_MESHER_ASKED"])
    with asked.open("a") as lines:
        lines.write("asked\\n")
    if len(asked.read_text().splitlines()) > 2:
        return points, tets
    corners = np.asarray(points)[np.asarray(tets)]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    return points, np.asarray(tets)[np.cumsum(volume) > 0.0126 * volume.sum()]


@hookimpl
def gradedesign_meshers():
    yield Mesher(name="fake-missing", worker="fake_missing", version="1")


if __name__ == "__main__":
    serve_mesher(mesh)
"""
#: A bar of four cells, two of which have room for a window.
WINDOWS = (
    held_bar(
        'box = ["32 mm", "8 mm", "8 mm"]\nmesh_size = "2 mm"',
        regions="".join(
            f'[[keep]]\nregion = "{region}"\nmargin = "1 mm"\n' for region in ("root", "tip")
        ),
    )
    + """\
[limits]
safety_factor = 1
[lattice]
cell = "gyroid-sheet"
size = "8 mm"
grading = "uniform"
density = [0.4, 0.5]
[run]
acceptance = "submodels"
mesher = "fake-missing"
max_iterations = 1
[output]
formats = ["report"]
"""
)


@pytest.mark.slow
def test_a_window_that_the_mesher_misses_is_left_out_of_a_run(install, tmp_path, cli, monkeypatch):
    install("fake-missing", MISSING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("FAKE_MESHER_ASKED", str(tmp_path / "asked"))
    (tmp_path / "case.toml").write_text(WINDOWS, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code in (0, 4), ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert (len(result["iterations"]), len(result["acceptance"]["submodels"])) == (1, 1)
    (stress,) = (row for row in result["limits"] if row["name"] == "stress in lattice")
    assert stress["remeshed"] == 0.5
    assert stress["judged_by"].endswith("times the ratio of 1 submodels, 1 left out")
    (told,) = (words for words in result["warnings"] if "was left out" in words)
    # Both sizes were tried: 1.26 % is missing of each.
    assert told.count("(off by 0.01") == 2
    assert "was left out" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
