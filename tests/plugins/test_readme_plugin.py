"""The plugin of plugins/README.md, built from its text: what a newcomer would paste."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from gradedesign.plugin.registry import build_registry
from gradedesign.testing import check_cell_family, check_scaling_law

README = Path(__file__).parents[2] / "plugins" / "README.md"

#: A thick-walled box of two cells whose only limit is loose: one round, then acceptance. The
#: [lattice] table is the README's, with a cell size that suits the box.
CASE = """
[case]
name = "readme"
[part]
box = ["16 mm", "8 mm", "8 mm"]
mesh_size = "4 mm"
[region.root]
plane = "x = min"
[region.tip]
plane = "x = max"
[material]
name = "Ti-6Al-4V"
[[keep]]
region = "root"
margin = "1.5 mm"
[[keep]]
region = "tip"
margin = "1.5 mm"
[[load_case]]
name = "shear"
fix = [{region = "root"}]
load = [{region = "tip", force = ["0 N", "0 N", "-100 N"]}]
[limits]
displacement = [{region = "tip", magnitude = "0.2 mm"}]
[run]
time = "5 min"
max_rounds = 1
mesh_cubes_per_wall = 2.0
acceptance = "whole"
[output]
formats = ["stl"]
"""


def blocks(language):
    """Fenced blocks of a language, in order."""
    text = README.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


def test_the_cell_is_short():
    code = [line for line in blocks("python")[0].splitlines() if line.strip()]
    assert len(code) <= 20


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build and unpack a wheel of the text; return the folder it would be installed in."""
    folder = tmp_path_factory.mktemp("readme")
    project = tomllib.loads(blocks("toml")[0])
    (folder / "pyproject.toml").write_text(blocks("toml")[0], encoding="utf-8")
    (module,) = project["project"]["entry-points"]["gradedesign"].values()
    (folder / f"{module}.py").write_text(blocks("python")[0], encoding="utf-8")
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


def test_the_cell_installs_is_found_and_conforms(built, monkeypatch):
    monkeypatch.syspath_prepend(str(built))
    registry = build_registry()
    family = registry.cell_families["acme-iwp-network"]
    assert registry.sources["cell_families"]["acme-iwp-network"] == "gradedesign-acme-iwp 0.1.0"
    check_cell_family(family)
    check_scaling_law(registry.scaling_laws["acme-iwp"])


def test_a_case_with_the_cell_reaches_a_verdict(built, tmp_path):
    lattice = tomllib.loads(blocks("toml")[1])["lattice"]
    assert lattice == {
        "cell": "acme-iwp-network",
        "size": "10 mm",
        "grading": "level",
        "density": [0.25, 0.55],
    }
    table = blocks("toml")[1].replace('"10 mm"', '"8 mm"')
    (tmp_path / "case.toml").write_text(CASE + table, encoding="utf-8")
    result = subprocess.run(
        [
            *(sys.executable, "-m", "gradedesign", "run", str(tmp_path)),
            *("-o", str(tmp_path / "run"), "--strict-plugins"),
        ],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": str(built)},
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
    assert (tmp_path / "run" / "lattice.stl").is_file()
