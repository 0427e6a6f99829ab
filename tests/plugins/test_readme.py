"""The plugin of plugins/README.md, built from its text: what a newcomer would paste."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from gradedesign.plugin.registry import build_registry
from gradedesign.testing import check_cell_family

README = Path(__file__).parents[2] / "plugins" / "README.md"


def blocks(language):
    """Fenced blocks of a language, in order."""
    text = README.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


def test_the_cell_is_short():
    code = [line for line in blocks("python")[0].splitlines() if line.strip()]
    assert len(code) <= 20


@pytest.fixture
def built(tmp_path):
    """Build and unpack a wheel of the text; return the folder it would be installed in."""
    project = tomllib.loads(blocks("toml")[0])
    (tmp_path / "pyproject.toml").write_text(blocks("toml")[0], encoding="utf-8")
    (module,) = project["project"]["entry-points"]["gradedesign"].values()
    (tmp_path / f"{module}.py").write_text(blocks("python")[0], encoding="utf-8")
    site = tmp_path / "site"
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"),
            *("--no-build-isolation", "--disable-pip-version-check"),
            *("--target", str(site), str(tmp_path)),
        ],
        check=True,
        timeout=120,
    )
    return site


def test_the_cell_installs_is_found_and_conforms(built, monkeypatch):
    monkeypatch.syspath_prepend(str(built))
    registry = build_registry()
    family = registry.cell_families["neovius-sheet"]
    assert registry.sources["cell_families"]["neovius-sheet"] == "gradedesign-neovius 0.1.0"
    check_cell_family(family)


def test_the_case_names_the_cell():
    assert tomllib.loads(blocks("toml")[1])["lattice"]["cell"] == "neovius-sheet"
