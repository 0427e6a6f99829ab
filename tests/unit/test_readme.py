"""The README and the Makefile say what the program does."""

import re
import tomllib
from pathlib import Path

from typer.main import get_command

from gradedesign import errors
from gradedesign.cli.app import app
from gradedesign.errors import GradeDesignError

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_command_and_option_of_the_table_exists():
    rows = re.findall(r"^\| `gradedesign (\w+)([^`]*)`", README, flags=re.MULTILINE)
    commands = get_command(app).commands
    assert {name for name, _ in rows} == set(commands)
    for name, rest in rows:
        options = {word for p in commands[name].params for word in p.opts}
        assert set(re.findall(r"-{1,2}[a-z-]+", rest)) <= options


def test_every_exit_code_is_explained():
    codes = {e.exit_code for e in vars(errors).values() if isinstance(e, type)}
    assert issubclass(errors.CaseError, GradeDesignError)
    told = {int(n) for cell in re.findall(r"^\| ([\d, ]+) \|", README, flags=re.MULTILINE)
            for n in cell.split(",")}  # fmt: skip
    assert codes | {0, 1, 4, 130} == told


def test_it_opens_with_the_two_commands():
    assert README.index("make run") < README.index("make test") < README.index("pip install")


def test_links_lead_somewhere():
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    missing = [link for link in links if not (ROOT / link).exists()]
    # The picture of the bracket is made by its run.
    assert set(missing) <= {"docs/pictures/bracket.png", "docs/homogenisation.md"}


def test_every_dependency_is_in_the_list_of_third_parties():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    listed = (ROOT / "THIRD_PARTY.md").read_text(encoding="utf-8")
    for line in project["dependencies"]:
        name, minimum = re.match(r"([\w-]+)>=([\d.]+)", line).groups()
        assert f"| {name} | >= {minimum} |" in listed
    for lines in project["optional-dependencies"].values():
        for line in lines:
            assert re.match(r"[\w-]+", line)[0] in listed


def test_the_build_calls_the_tests():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert script.rstrip().endswith("make test")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in ("install", "run", "test", "test-all", "bench"):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)
