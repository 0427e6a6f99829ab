"""The plugin of plugins/README.md, built from its text: what a newcomer would paste."""

import json
import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import trimesh
from small_parts import SHORT_BAR

from gradedesign import PluginError
from gradedesign.design.resolve.choose_law import choose_law
from gradedesign.program.host.registry import build_registry
from gradedesign.testing import check_cell_family, check_scaling_law

README = Path(__file__).parents[2] / "plugins" / "README.md"

#: A thick-walled box of two cells whose only limit is loose: one iteration, then acceptance. The
#: [lattice] table is the README's, with a cell size that suits the box.
CASE = (
    SHORT_BAR
    + """
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.2 mm"}]
[run]
time = "5 min"
max_iterations = 1
elements_per_wall = 2.0
acceptance = "whole"
[output]
formats = ["stl", "ply", "voxels"]
"""
)


def blocks(language):
    """Fenced blocks of a language, in order."""
    text = README.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


def test_the_cell_is_short():
    code = [line for line in blocks("python")[0].splitlines() if line.strip()]
    assert len(code) <= 20


def install(folder):
    """Build and unpack a wheel of a project; return the folder it would be installed in."""
    site = folder / "site"
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"),
            *("--no-build-isolation", "--disable-pip-version-check"),
            *("--target", str(site), str(folder)),
        ],
        check=True,
        timeout=120,
    )
    return site


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The first cell of the text, installed."""
    folder = tmp_path_factory.mktemp("readme")
    project = tomllib.loads(blocks("toml")[0])
    (folder / "pyproject.toml").write_text(blocks("toml")[0], encoding="utf-8")
    (module,) = project["project"]["entry-points"]["gradedesign"].values()
    (folder / f"{module}.py").write_text(blocks("python")[0], encoding="utf-8")
    return install(folder)


def with_words(language, words):
    """The one block of a language that holds these words."""
    (found,) = (block for block in blocks(language) if words in block)
    return found


def test_every_block_of_python_compiles():
    for number, block in enumerate(blocks("python")):
        compile(block, f"block {number}", "exec")


def test_a_sheet_returns_the_size_of_its_function():
    names = {}
    exec(with_words("python", "acme-p-sheet"), names)
    (family,) = names["gradedesign_cell_families"]()
    check_cell_family(family)
    # What the text warns of: without abs the solid is one side of the surface.
    shape = replace(family, shape=lambda u: np.cos(2 * np.pi * u).sum(axis=0))
    with pytest.raises(PluginError, match=r"use abs\(f\)"):
        check_cell_family(shape)


def test_the_struts_and_their_table_install_and_make_a_law(tmp_path, monkeypatch):
    text = with_words("python", "acme-a15")
    project = blocks("toml")[0].partition("[tool.hatch")[0] + with_words("toml", "packages = ")
    project = project.replace("acme-iwp", "acme-a15").replace("acme_iwp", "acme_a15")
    package = tmp_path / "gradedesign_acme_a15"
    (package / "properties").mkdir(parents=True)
    (tmp_path / "pyproject.toml").write_text(project, encoding="utf-8")
    (package / "__init__.py").write_text(text, encoding="utf-8")
    (package / "properties" / "__init__.py").write_text("", encoding="utf-8")
    # Another cell's table under this one's name: computing one takes a minute.
    strut = resources.files("gradedesign_cells_strut.properties") / "bcc.json"
    table = json.loads(strut.read_text(encoding="utf-8"))
    table |= {"name": "acme-a15-computed", "family": "acme-a15", "parameters": {}}
    (package / "properties" / "acme-a15.json").write_text(json.dumps(table), encoding="utf-8")
    monkeypatch.syspath_prepend(str(install(tmp_path)))
    registry = build_registry()
    family = registry.cell_families["acme-a15"]
    assert family.symmetry == "cubic"
    check_cell_family(family)
    # Chains of six bonds half a cell long, 24 bonds from chains to corners: 16.4 cells of strut.
    points = np.random.default_rng(20220703).uniform(size=(3, 400_000))
    share = float(np.mean(family.shape(points) <= 0.01))
    assert share == pytest.approx(np.pi * 0.01**2 * (6 * 0.5 + 24 * 5**0.5 / 4), rel=0.05)
    law = choose_law(registry, "acme-a15", "auto", (0.1, 0.3))
    assert (law.name, law.kind) == ("acme-a15-computed", "computed")


def test_the_cell_installs_is_found_and_conforms(built, monkeypatch):
    monkeypatch.syspath_prepend(str(built))
    registry = build_registry()
    family = registry.cell_families["acme-iwp-network"]
    assert registry.sources["cell_families"]["acme-iwp-network"] == "gradedesign-acme-iwp 0.1.0"
    check_cell_family(family)
    check_scaling_law(registry.scaling_laws["acme-iwp"])


def test_a_case_with_the_cell_reaches_a_verdict(built, formats_site, tmp_path):
    lattice = tomllib.loads(blocks("toml")[1])["lattice"]
    assert lattice == {
        "cell": "acme-iwp-network",
        "size": "10 mm",
        "grading": "level",
        "density": [0.25, 0.55],
    }
    # cells alone: one iteration of members does not end within 3 % of the limit
    table = blocks("toml")[1].replace('"10 mm"', '"8 mm"\nphases = ["lattice"]')
    (tmp_path / "case.toml").write_text(CASE + table, encoding="utf-8")
    path = [str(built), str(formats_site), *filter(None, [os.environ.get("PYTHONPATH")])]
    result = subprocess.run(
        [
            *(sys.executable, "-m", "gradedesign", "run", str(tmp_path)),
            *("-o", str(tmp_path / "run"), "--strict-plugins"),
        ],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        check=False,
    )
    assert result.returncode == 0, result.stderr
    data = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert data["status"] == "met"
    assert data["lightest"] is True
    assert data["acceptance"]["scope"] == "whole"
    assert data["law"]["name"] == "acme-iwp"
    assert data["law"]["cell"] == "acme-iwp-network"
    assert "gradedesign-acme-iwp 0.1.0" in data["plugins"]
    # What was judged, in the STL that acceptance read back, in another format of the core, and in
    # that of the other plugin.
    assert (data["files"]["stl"], data["files"]["lattice_ply"]) == ("lattice.stl", "lattice.ply")
    assert data["files"]["lattice_voxels"] == "lattice.npz"
    one, other = (trimesh.load(tmp_path / "run" / f"lattice.{s}") for s in ("stl", "ply"))
    assert other.is_watertight
    assert other.volume == pytest.approx(one.volume, rel=1e-6)
