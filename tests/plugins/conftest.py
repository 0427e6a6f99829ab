"""Installed distributions, laid out as pip leaves them."""

import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from gradedesign.program.host import command


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Lay out a distribution with one module and put it on the path."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def lay_out(distribution, source, version="1.2"):
        command._installed.cache_clear()
        module = distribution.replace("-", "_")
        (tmp_path / f"{module}.py").write_text(textwrap.dedent(source), encoding="utf-8")
        info = tmp_path / f"{module}-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {distribution}\nVersion: {version}\n", encoding="utf-8"
        )
        (info / "entry_points.txt").write_text(
            f"[gradedesign]\n{distribution} = {module}\n", encoding="utf-8"
        )

    before = set(sys.modules)
    yield lay_out
    command._installed.cache_clear()
    for name in set(sys.modules) - before:
        if name.startswith("fake_"):
            del sys.modules[name]


@pytest.fixture(scope="session")
def formats_site(tmp_path_factory):
    """Where the formats of plugins/README.md are installed."""
    return readme_site(tmp_path_factory.mktemp("formats"), "acme_formats", "gradedesign_exporters")


@pytest.fixture(scope="session")
def mesher_site(tmp_path_factory):
    """Where the mesher of plugins/README.md is installed."""
    return readme_site(tmp_path_factory.mktemp("mesher"), "acme_mesher", "gradedesign_meshers")


@pytest.fixture(scope="session")
def repairer_site(tmp_path_factory):
    """Where the repairer of plugins/README.md is installed."""
    return readme_site(tmp_path_factory.mktemp("hull"), "acme_hull", "gradedesign_repairers")


def readme_site(folder, name, hook):
    """Build a wheel of a module in plugins/README.md and return where it is installed."""
    text = (Path(__file__).parents[2] / "plugins" / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(?:python|toml)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    (module,) = (block for block in blocks if f"def {hook}" in block)
    project = next(block for block in blocks if "[build-system]" in block)
    project = project.replace("acme-iwp", name.replace("_", "-")).replace("acme_iwp", name)
    (folder / "pyproject.toml").write_text(project, encoding="utf-8")
    (folder / f"gradedesign_{name}.py").write_text(module, encoding="utf-8")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir"]
    subprocess.run(
        [*build, str(folder / "dist"), str(folder)], check=True, timeout=120, capture_output=True
    )
    (wheel,) = (folder / "dist").glob("*.whl")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run(
        [*install, "--disable-pip-version-check", "--target", str(folder / "site"), str(wheel)],
        check=True,
        timeout=120,
    )
    return folder / "site"
