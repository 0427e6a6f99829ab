"""The site of docs/: every page in it, its references as the code has them."""

import json
import re
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Annotated, get_args, get_origin

import pytest
import typer
from PIL import Image
from pydantic import TypeAdapter

import gradedesign
from gradedesign import load_case
from gradedesign.common.values.table import Table
from gradedesign.design.case.schema import CaseFile, schema_json, with_brought
from gradedesign.program.commands.app import app
from gradedesign.program.host import hookspecs
from gradedesign.program.host.read_case import brought_by
from gradedesign_validate.expected_values import read_expected

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


def script(name):
    """A script of docs/ as a module."""
    spec = spec_from_file_location(name, DOCS / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pages():
    return script("site_pages")


def test_every_page_has_its_place():
    shown = set(re.findall(r": (\S+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.M))
    made = set(re.findall(r'"(\S+\.md)": ', (DOCS / "site_pages.py").read_text("utf-8")))
    assert len(made) == 8
    assert shown == made | {p.relative_to(DOCS).as_posix() for p in DOCS.rglob("*.md")}


def keys_of(table, around=""):
    """Every key below a table of a case: its dotted name and its field."""
    for name, field in table.model_fields.items():
        dotted = f"{around}{field.alias or name}"
        if around:
            yield dotted, field
        named = ".NAME" if get_origin(field.annotation) is dict else ""
        for inner in tables_in(field.annotation):
            yield from keys_of(inner, f"{dotted}{named}.")


def tables_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for argument in get_args(annotation):
        yield from tables_in(argument)


def own_value(field, text):
    """What the type of a key reads from `key = value`."""
    (value,) = tomllib.loads(text).values()
    stated = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    return TypeAdapter(stated).validate_python(value)


def test_every_key_of_a_case_has_type_unit_range_default_and_example(pages):
    text = "\n".join(pages.case_keys())
    brought = brought_by(None)
    schema = schema_json(CaseFile, brought)
    blocks = dict(pages.case_blocks(schema))
    fields = dict(keys_of(with_brought(CaseFile, brought)))
    assert {name for name in blocks if name[0] != "["} == set(fields)
    assert {"region.NAME.plane.normal", "limits.compliance.work", "load_case.fix.region"} < {
        *fields
    }
    for name, block in blocks.items():
        assert block in text or f"#{block}" in text, name
    for name, field in fields.items():
        heading, _, meaning, *_, row = blocks[name].strip().split("\n")
        five = [cell.strip() for cell in row.strip("|").split(" | ")]
        assert (heading, len(five), all([meaning, *five])) == (f"### `{name}`", 5, True)
        *_, default, example = (cell.strip("`") for cell in five)
        assert example.startswith(f"{name.rpartition('.')[2]} = ")
        own_value(field, example)
        assert (default == "required") == field.is_required(), name
        if default not in ("required", "none"):
            assert own_value(field, f"key = {default}") == field.default, name
    for name in schema["definitions"]:
        assert not re.search(rf"\b{name}\b", text)


def test_units_and_ranges_are_those_that_a_case_states(pages):
    blocks = dict(pages.case_blocks(schema_json(CaseFile, brought_by(None))))
    for name, row in {
        "lattice.size": "| length or list of 2 to 3 lengths | mm | at least 1 um and at most "
        '100000 mm | required | `size = "8 mm"` |',
        "run.memory": '| amount of memory | GB | at least 0.1 GB | `"8 GB"` | `memory = "8 GB"` |',
        "limits.percentile": "| number | none | above 50 and at most 100 | `99.5` | "
        "`percentile = 99.5` |",
        "lattice.drain": '| table | none | as its keys | none | `drain = {diameter = "3 mm"}` |',
    }.items():
        assert blocks[name].strip().endswith(row)


def test_every_command_option_hook_and_name_is_listed(pages):
    text = "\n".join(pages.commands())
    group = typer.main.get_command(app)
    for name in group.list_commands(None):
        command = group.get_command(None, name)
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
    assert {"geometry/part", "mechanics/sizing", "pipeline", "program/commands"} <= set(rooms)


def test_the_picture_of_the_rooms_is_of_today():
    drawn = (DOCS / "pictures" / "rooms.svg").read_text(encoding="utf-8")
    assert script("make_figures").rooms_svg() == drawn, "run: python docs/make_figures.py"


def test_pictures_are_those_of_finished_runs(tmp_path, capsys):
    made = script("make_pictures")
    for name, status in (
        ("block", "met"),
        ("lug", "failed"),
        (made.TUTORIAL, "met"),
        (made.FLAGSHIP, "not_met"),
    ):
        run, case = tmp_path / "runs" / name, tmp_path / "cases" / name
        for folder in (run, case):
            folder.mkdir(parents=True)
            for k, picture in enumerate(made.SHOWN):
                colour = (10 * k, 200, 255 if folder is run else 0)
                Image.new("RGB", (40, 30), colour).save(folder / picture)
        (run / "result.json").write_text(json.dumps({"status": status}), encoding="utf-8")
    (tmp_path / "docs" / "pictures").mkdir(parents=True)
    made.main(tmp_path)

    def pixel(path, at=(1, 1)):
        with Image.open(tmp_path / path) as image:
            return image.convert("RGB").getpixel(at)

    assert pixel("cases/block/density.png") == (10, 200, 255)
    assert pixel("cases/lug/density.png") == (10, 200, 0)
    assert pixel("docs/pictures/tutorial-stress.png") == (30, 200, 255)
    assert "cases/lug" not in capsys.readouterr().out
    # The third of four lies below the first.
    assert pixel("docs/pictures/flagship.png", (10, made.WIDTH * 30 // 40 - 1)) == (20, 200, 255)


def test_the_commands_of_the_validation_exist():
    text = (DOCS / "validation.md").read_text(encoding="utf-8")
    tests = re.findall(r"`pytest (\S+?)(?:::(\w+))?`", text)
    assert set(re.findall(r"`gradedesign (\w+)", text)) <= set(
        typer.main.get_command(app).list_commands(None)
    )
    assert len(tests) > 30
    for path, name in tests:
        assert f"def {name}" in (ROOT / path).read_text(encoding="utf-8"), (path, name)


def test_the_tutorial_is_the_case_that_it_shows():
    case = load_case(DOCS / "tutorial")
    assert (case.name, case.part.file.name) == ("bar", "bar.stl")
    for page, name in (("tutorial.md", "case.toml"), ("sweep.md", "study.toml")):
        shown = (DOCS / "tutorial" / name).read_text(encoding="utf-8")
        assert f"\n{shown}```" in (DOCS / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda p: p.stem)
def test_every_case_fragment_is_toml_with_keys_that_exist(page, pages, tmp_path):
    schema = schema_json(CaseFile, brought_by(None))
    for text in re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S):
        if page.stem == "limits":
            text = text if text.startswith("[") else f"[limits]\n{text}"
        if "origin =" in text and "value =" in text:
            (tmp_path / "expected.toml").write_text(text, encoding="utf-8")
            assert read_expected(tmp_path / "expected.toml")
            continue
        for section, body in tomllib.loads(text).items():
            allowed = set()
            for name in pages._references(schema["properties"].get(section, {})):
                allowed |= set(schema["definitions"][name]["properties"])
            tables = body if isinstance(body, list) else [body]
            if section == "region":
                tables = body.values()
            for table in tables:
                assert set(table) <= allowed, (section, set(table) - allowed)
