"""Writes ``recipe.yaml``, a conda package of each distribution, from the pyproject files.

``python conda/make_recipe.py`` beside it, then ``rattler-build build --recipe conda``.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
#: Folders of the distributions, the core first.
FOLDERS = (ROOT, *(path.parent for path in sorted(ROOT.glob("plugins/*/pyproject.toml"))))

HEAD = """\
# Written by make_recipe.py from the pyproject files; a test compares.
# Dependencies have their names on PyPI. No channel has resolved them yet.
schema_version: 1
context:
  version: {version}
recipe:
  name: gradedesign-distributions
  version: ${{{{ version }}}}
source:
  path: ..
build:
  number: 0
outputs:
"""

OUTPUT = """\
  - package:
      name: {name}
    build:
      noarch: python
      script: ${{{{ PYTHON }}}} -m pip install {folder} --no-deps --no-build-isolation -vv
{scripts}    requirements:
      host: [python {python}, pip, hatchling]
      run:
        - python {python}
{run}    tests:
      - python:
          imports: [{module}]
    about:
      summary: {summary}
      license: {license}
      license_file: {licence}
"""


def recipe() -> str:
    """Text of the recipe."""
    projects = [(folder, _project(folder)) for folder in FOLDERS]
    head = HEAD.format(version=projects[0][1]["version"])
    return head + "".join(_output(folder, project) for folder, project in projects)


def _project(folder: Path) -> dict[str, Any]:
    text = (folder / "pyproject.toml").read_text(encoding="utf-8")
    project: dict[str, Any] = tomllib.loads(text)["project"]
    return project


def _output(folder: Path, project: dict[str, Any]) -> str:
    below = folder.relative_to(ROOT).as_posix()
    scripts = "".join(f"          - {k} = {v}\n" for k, v in project.get("scripts", {}).items())
    return OUTPUT.format(
        name=project["name"],
        folder=below if below == "." else f"./{below}",
        scripts=f"      python:\n        entry_points:\n{scripts}" if scripts else "",
        python=project["requires-python"],
        run="".join(f"        - {_spaced(one)}\n" for one in project["dependencies"]),
        module=project["name"].replace("-", "_"),
        summary=json.dumps(project["description"]),
        license=project["license"],
        licence=(folder / "LICENSE").relative_to(ROOT).as_posix(),
    )


def _spaced(requirement: str) -> str:
    """A requirement of a pyproject file as conda writes it, with a blank after the name."""
    end = next((n for n, c in enumerate(requirement) if c in "<>=!~"), len(requirement))
    return f"{requirement[:end]} {requirement[end:]}".strip()


if __name__ == "__main__":
    (Path(__file__).parent / "recipe.yaml").write_text(recipe(), encoding="utf-8")
