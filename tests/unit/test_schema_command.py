"""`gradedesign schema`: editors take the shipped cases, and refuse what the program refuses."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

ROOT = Path(__file__).parents[2]
CASES = sorted(ROOT.glob("cases/*/case.toml"))


@pytest.fixture
def schema(cli):
    ended = cli("schema")
    assert ended.code == 0
    data = json.loads(ended.out)
    jsonschema.Draft7Validator.check_schema(data)
    return data


@pytest.mark.parametrize("path", CASES, ids=lambda p: p.parent.name)
def test_every_shipped_case_is_valid(schema, path):
    jsonschema.validate(tomllib.loads(path.read_text(encoding="utf-8")), schema)


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("lattice", "gradings", "level"),
        ("lattice", "grading", "levels"),
        ("part", "mesh_size", 12),
        ("limits", "percentile", 101.0),
        ("run", "max_iterations", "six"),
        ("material", "name", ""),
    ],
)
def test_what_a_reader_refuses_is_not_valid(schema, table, key, value):
    case = tomllib.loads((ROOT / "cases" / "mini" / "case.toml").read_text(encoding="utf-8"))
    jsonschema.validate(case, schema)
    case.setdefault(table, {})[key] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(case, schema)


def test_defaults_and_examples_are_valid_as_written(cli):
    schema = json.loads(cli("schema").out)
    schema_of_all = {name: schema[name] for name in ("$schema", "definitions")}
    stated = 0
    for body in schema["definitions"].values():
        for key in body["properties"].values():
            for value in (
                *key.get("examples", ()),
                *([key["default"]] if "default" in key else ()),
            ):
                jsonschema.validate(value, {**schema_of_all, **key})
                stated += 1
    assert stated > 100


@pytest.mark.parametrize(
    "stated",
    [{"density": 0.3}, {"density": "0.2 + 0.01 * x"}, {"density_map": {"formula": "0.2"}}],
)
def test_loads_are_required_unless_the_density_is_stated(schema, stated):
    case = {
        "case": {"name": "block"},
        "part": {"box": ["20 mm", "20 mm", "20 mm"]},
        "lattice": {"cell": "sc", "size": "10 mm", **stated},
    }
    jsonschema.validate(case, schema)
    for found in ({}, {"density": [0.2, 0.3]}):
        case["lattice"] = {"cell": "sc", "size": "10 mm", **found}
        with pytest.raises(jsonschema.ValidationError, match="is a required property"):
            jsonschema.validate(case, schema)


def test_the_schema_of_studies(cli):
    schema = json.loads(cli("schema", "--study").out)
    study = tomllib.loads((ROOT / "docs" / "tutorial" / "study.toml").read_text("utf-8"))
    jsonschema.validate(study, schema)
    for wrong in ({"vary": study["vary"]}, {**study, "varied": {}}, {**study, "design": {}}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)


def test_a_folder_that_is_not_there_is_refused(cli, tmp_path):
    ended = cli("schema", "-o", tmp_path / "no" / "case.schema.json")
    assert ended.code in (2, 5)
    assert "Traceback" not in ended.err
