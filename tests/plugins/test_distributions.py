"""Wheels carry what they need; extra, recipe, container and citation name the distributions."""

import importlib.util
import subprocess
import tomllib
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[2]
PLUGINS = sorted(path.parent for path in ROOT.glob("plugins/*/pyproject.toml"))
#: Why these two are left out of ``gradedesign[all]`` stands in docs/decisions/program.md.
LEFT_OUT = {"gradedesign-pymeshlab", "gradedesign-step"}


def project(folder):
    return tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("folder", [ROOT, *PLUGINS], ids=lambda folder: folder.name)
def test_a_wheel_carries_every_file_of_its_package_and_the_licence(folder, tmp_path):
    """Tables, materials, templates and scripts of pages: all that stands in the repository."""
    (built,) = WheelBuilder(str(folder)).build(directory=str(tmp_path), versions=["standard"])
    listing = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "src"]
    listed = subprocess.run(listing, cwd=folder, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a clone: what belongs to the package is not known")
    there = [name for name in listed.stdout.split() if (folder / name).exists()]
    expected = {name.removeprefix("src/") for name in there}
    with zipfile.ZipFile(built) as wheel:
        held = set(wheel.namelist())
        licences = [wheel.read(name) for name in held if name.endswith("licenses/LICENSE")]
    assert expected - held == set()
    assert {name for name in held - expected if ".dist-info/" not in name} == set()
    text = (
        b"GNU GENERAL PUBLIC LICENSE"
        if folder.name in LEFT_OUT - {"gradedesign-step"}
        else ((ROOT / "LICENSE").read_bytes())
    )
    assert len(licences) == 1
    assert text in licences[0]


def test_all_brings_every_distribution_but_two():
    core = project(ROOT)
    names = {folder.name for folder in PLUGINS} - LEFT_OUT
    assert core["optional-dependencies"]["all"] == [f"{name}>=0.1" for name in sorted(names)]
    assert core["version"].startswith("0.1")
    for folder in PLUGINS:
        plugin = project(folder)
        assert (plugin["name"], plugin["version"]) == (folder.name, core["version"])
        assert "gradedesign>=0.1" in plugin["dependencies"]


def test_the_conda_recipe_is_made_from_the_projects():
    path = ROOT / "conda" / "make_recipe.py"
    spec = importlib.util.spec_from_file_location("make_recipe", path)
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    assert (path.parent / "recipe.yaml").read_text(encoding="utf-8") == made.recipe()
    for folder in (ROOT, *PLUGINS):
        assert f"name: {project(folder)['name']}\n" in made.recipe()
        for requirement in project(folder)["dependencies"]:
            assert made._spaced(requirement).replace(" ", "") == requirement


def test_the_citation_and_the_container_speak_of_this_version():
    core = project(ROOT)
    stated = dict(
        line.split(": ", 1)
        for line in (ROOT / "CITATION.cff").read_text(encoding="utf-8").splitlines()
        if ": " in line
    )
    same = {"title": "name", "version": "version", "license": "license", "abstract": "description"}
    assert {key: stated[key] for key in same} == {key: core[of] for key, of in same.items()}
    container = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert "gradedesign[all]" in container
    newest = [c for c in core["classifiers"] if c.startswith("Programming Language")][-1]
    assert f"FROM python:{newest.split()[-1]}-slim" in container
