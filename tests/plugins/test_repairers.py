"""A repairer of a plugin end to end: the README's, built, installed and named by a case."""

import json
import os
import re
import sys
from pathlib import Path

import pytest
from damaged_shapes import CUBE, binary
from small_parts import held_bar

README = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
TOML = re.findall(r"^```toml\n(.*?)^```$", README, flags=re.DOTALL | re.MULTILINE)
(PART,) = (block for block in TOML if 'repair = "acme' in block)
CASE = (
    held_bar(PART.removeprefix("[part]\n") + 'mesh_size = "8 mm"', force="0 N, 0 N, -1 N")
    + """\
[limits]
displacement = [{region = "tip", magnitude = "9 mm"}]
[lattice]
cell = "gyroid-sheet"
size = "20 mm"
density = [0.2, 0.5]
"""
)


@pytest.fixture
def installed(repairer_site, tmp_path, monkeypatch):
    """The README's repairer, as if installed, beside a cube that lacks a facet."""
    monkeypatch.syspath_prepend(str(repairer_site))
    monkeypatch.setenv("PYTHONPATH", str(repairer_site), prepend=os.pathsep)
    (tmp_path / "part.stl").write_bytes(binary(CUBE[1:]))
    yield
    sys.modules.pop("gradedesign_acme_hull", None)


def check(cli, folder, *changes):
    """The end of `check` on the case with some texts of it replaced."""
    text = CASE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return cli("check", folder, "--no-picture", "--json")


def test_a_case_is_repaired_by_the_plugin_that_it_names(installed, tmp_path, cli):
    ended = check(cli, tmp_path)
    assert ended.code == 0, ended.err
    checked = json.loads(ended.out)
    assert checked["part"]["volume_mm3"] == pytest.approx(8000.0)
    assert checked["part"]["repairs"] == {"holes_filled": 1, "facets_replaced": 11}
    (note,) = (w for w in checked["warnings"] if "mended by" in w)
    assert "mended by 'acme-hull' (facets replaced 11), volume 8000 mm^3" in note


WRONG = [
    ("acme-hull", "acme-hul", 'did you mean "acme-hull"?'),
    ("acme-hull", 'auto"\nrepair_options = {edge = 3}#', 'repair = "auto" has no options'),
    ('acme-hull"', 'acme-hull"\nrepair_options = {edge = 3}', "'acme-hull' has no such option"),
    ('acme-hull"', 'acme-hull"\nrepair_options = {edge = "3 N"}', "a length such as"),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_a_wrong_name_or_option_is_told(installed, tmp_path, cli, old, new, words):
    ended = check(cli, tmp_path, (old, new))
    assert ended.code == 2
    assert re.search(r"^(error: )?case.toml:\d+: part.repair[._a-z]*: ", ended.err, re.M)
    assert words in ended.err


BROKEN = [
    ("return vertices, facets,", "return vertices, facets[1:],", 3, "leaves 1 holes: 3 edges"),
    ("return vertices, facets,", "return 1.01 * vertices, facets,", 3, "changes the volume from"),
    ("return vertices, facets,", "return vertices, 1.0 * facets,", 7, "float64 faces (12, 3)"),
    ("return vertices, facets,", "return vertices, facets - 1,", 7, "corners that do not exist"),
    ("hull = ConvexHull", "import os; os.abort(); hull = ConvexHull", 3, "crashed with SIGABRT"),
]


@pytest.mark.parametrize(("old", "new", "code", "words"), BROKEN)
def test_what_a_repairer_does_wrong_is_told(
    installed, tmp_path, cli, repairer_site, monkeypatch, old, new, code, words
):
    text = (repairer_site / "gradedesign_acme_hull.py").read_text(encoding="utf-8")
    assert old in text
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "gradedesign_acme_hull.py").write_text(text.replace(old, new), encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(broken), prepend=os.pathsep)
    (tmp_path / "part.stl").write_bytes(binary(CUBE))
    ended = check(cli, tmp_path)
    assert ended.code == code
    assert words in ended.err
    assert "acme-hull" in ended.err
