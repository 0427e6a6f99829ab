"""The site of docs/: every page in it, its references as the code has them."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
import typer

import gradedesign
from gradedesign.case.schema import CaseFile, schema_json
from gradedesign.cli.app import app
from gradedesign.plugin import hookspecs

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def pages():
    spec = spec_from_file_location("site_pages", DOCS / "site_pages.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_page_has_its_place():
    shown = set(re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.M))
    made = set(re.findall(r'"(\S+\.md)": ', (DOCS / "site_pages.py").read_text("utf-8")))
    assert len(made) == 5
    assert shown == made | {p.relative_to(DOCS).as_posix() for p in DOCS.rglob("*.md")}


def test_every_key_of_a_case_is_explained(pages):
    text = "\n".join(pages.case_keys())
    schema = schema_json(CaseFile)
    for name in schema["properties"]:
        assert f"## [{name}]\n" in text
    for body in schema["definitions"].values():
        for key in body["properties"]:
            assert f"| `{key}` |" in text


def test_every_command_option_hook_and_name_is_listed(pages):
    text = "\n".join(pages.commands())
    for name, command in typer.main.get_command(app).commands.items():
        assert f"## gradedesign {name}\n" in text
        for option in command.params:
            assert option.opts[0] in text or option.name.upper() in text
    hooks = [name for name in vars(hookspecs) if name.startswith("gradedesign_")]
    assert hooks
    assert all(f"hookspecs.{name}\n" in "\n".join(pages.hooks()) for name in hooks)
    listed = "\n".join(pages.api())
    for name in gradedesign.__all__:
        assert re.search(rf"\.{name}\n", listed) or name == "hookimpl"


def test_the_rooms_are_those_of_the_order_of_imports(pages):
    rooms = [row.split("`")[1] for row in pages.rooms() if "`" in row]
    assert rooms[0] == "errors"
    assert {"part", "sizing", "pipeline", "cli"} <= set(rooms)


def test_the_commands_of_the_validation_exist():
    text = (DOCS / "validation.md").read_text(encoding="utf-8")
    tests = re.findall(r"`pytest (\S+?)(?:::(\w+))?`", text)
    assert len(tests) > 30
    for path, name in tests:
        assert f"def {name}" in (ROOT / path).read_text(encoding="utf-8"), (path, name)
