"""Parts that are rebuilt from damaged triangles, through the case."""

import json
import struct

import numpy as np
import pytest
import trimesh
from damaged_shapes import binary, box

CASE = """\
[case]
name = "rebuilt"
[part]
file = "part.stl"
units = "mm"
mesh_size = "4 mm"
repair = "rebuild"
repair_options = { spacing = "0.4 mm" }
[lattice]
cell = "gyroid-sheet"
size = "5 mm"
density = 0.3
"""


def write_part(path):
    """A ball of 5 mm with 1 % of its triangles missing, 5 % turned around, 1 % doubled."""
    rng = np.random.default_rng(37)
    corners = trimesh.creation.icosphere(subdivisions=4, radius=5.0).triangles
    corners = corners[rng.random(len(corners)) > 0.01].copy()
    turned = rng.random(len(corners)) < 0.05
    corners[turned] = corners[turned][:, ::-1]
    corners = np.concatenate([corners, corners[rng.random(len(corners)) < 0.01]])
    records = np.zeros(len(corners), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    records["c"] = corners
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + records.tobytes())


def generate(folder, cli, old="", new=""):
    """The end of `generate` on the case with a text of it replaced."""
    write_part(folder / "part.stl")
    (folder / "case.toml").write_text(CASE.replace(old, new), encoding="utf-8")
    return cli("run", folder / "case.toml", "-o", folder / "out")


def test_a_soup_becomes_a_lattice(tmp_path, cli):
    ended = generate(tmp_path, cli)
    assert ended.code == 0, ended.err
    result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert result["repairs"]["triangles_rebuilt"] > 1000
    volume = result["measures"]["volume_mm3"] / result["relative_density"]
    # The inscribed ball itself encloses 4/3 pi 5^3 mm^3 less 0.2 %.
    assert volume == pytest.approx(4 / 3 * np.pi * 125, rel=0.01)
    assert any("mended by 'rebuild'" in w for w in result["warnings"])


@pytest.mark.parametrize(("bodies", "code"), [("one", 3), ("all", 3), ("join", 0)])
def test_a_grid_joins_solids_that_touch_only_where_the_case_says_so(tmp_path, cli, bodies, code):
    halves = box((0, 0, 0), (5.1, 8, 8)), box((5.1, 0, 0), (10, 8, 8))
    (tmp_path / "part.stl").write_bytes(binary(np.concatenate(halves)))
    text = CASE.replace('repair = "', f'bodies = "{bodies}"\nrepair = "')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    ended = cli("run", tmp_path, "-o", tmp_path / "out")
    assert ended.code == code, ended.err
    said = " ".join((ended.out + ended.err).split())
    assert "makes 1 of 2 solids that touch along 64 mm^2" in said


WRONG = [
    ('"0.4 mm"', '"4 mm"', "expected a 10th of its longest edge"),
    ("spacing =", "edge =", 'write spacing = "0.5 mm"'),
    ('repair = "rebuild"', 'repair = "safe"', 'repair = "safe" has no options'),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG)
def test_a_grid_that_does_not_serve_is_refused(tmp_path, cli, old, new, words):
    ended = generate(tmp_path, cli, old, new)
    assert ended.code == 2
    assert words in ended.err
