"""Pages of the site that are made from the code: case keys, commands, hooks, API, rooms.

mkdocs calls `on_files`; nothing here is imported by gradedesign.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

import gradedesign
from gradedesign.case.generate_schema import GenerateFile
from gradedesign.case.schema import CaseFile, schema_json
from gradedesign.cli.app import app
from gradedesign.plugin import hookspecs
from gradedesign.plugin.read_case import entries_of

ROOT = Path(__file__).parents[1]


def on_files(files: Any, config: Any) -> Any:
    """Add the pages."""
    from mkdocs.structure.files import File  # only here, so that tests need no mkdocs

    plugins = (ROOT / "plugins" / "README.md").read_text(encoding="utf-8")
    for name, text in {
        "reference/case-keys.md": "\n".join(case_keys()),
        "reference/commands.md": "\n".join(commands()),
        "reference/hooks.md": "\n".join(hooks()),
        "reference/api.md": "\n".join(api()),
        "how-to/plugins.md": within_site(plugins),
    }.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the table of rooms where a page asks for it."""
    return markdown.replace("<!-- rooms -->", "\n".join(rooms()))


def within_site(text: str) -> str:
    """Links of plugins/README.md as the site has them; those to other files become plain text."""
    text = text.replace("](../docs/", "](../")
    return re.sub(r"\[([^\]]+)\]\((?!\.\./|#|https?:)[^)]+\)", r"\1", text)


def case_keys() -> Iterator[str]:
    """Every section of a case file with its keys, from the schema that reads it."""
    both = [schema_json(layout, entries_of(None)) for layout in (CaseFile, GenerateFile)]
    properties = {k: v for schema in reversed(both) for k, v in schema["properties"].items()}
    definitions = {k: v for schema in reversed(both) for k, v in schema["definitions"].items()}
    yield "# Case keys\n\nWritten from the schema that reads case files. Every value of a quantity"
    yield 'carries its unit, as in `"12 mm"`; unknown keys are errors.\n'
    used = {_reference(p): key for schema in both for key, p in schema["properties"].items()}
    for name in sorted(definitions, key=lambda name: _place(name, used, properties)):
        body = definitions[name]
        other = "" if name in both[0]["definitions"] else ", of `gradedesign generate`"
        yield f"## {_heading(used[name], properties) if name in used else name}{other}\n"
        yield f"{_sentence(body.get('description', ''))}\n"
        yield "| Key | Value | Default | Meaning |\n|---|---|---|---|"
        for key, value in body["properties"].items():
            needed = key in body.get("required", ())
            shown = "required" if needed else _default(key, value.get("default"))
            about = definitions.get(_reference(value), {})
            meaning = _described({"description": about.get("description", ""), **value})
            yield f"| `{key}` | {_kind(value)} | {shown} | {_sentence(meaning)} |"
        yield ""


#: Defaults of quantities as a case would state them, by key and by what reading makes of them.
STATED = {
    ("memory", "8000000000"): "8 GB",
    ("time", "3600.0"): "60 min",
    ("temperature_change", "0.0"): "0 K",
    ("exclusion_radius", "{'radius': None, 'mesh_sizes': None}"): "a quarter of a cell, or less",
    ("angle", "15.0"): "15 deg",
    ("polar_cap", "15.0"): "15 deg",
}


def _default(key: str, value: Any) -> str:
    """A default as a case would state it; empty where there is none."""
    if value is None or value in ([], {}):
        return ""
    said = STATED.get((key, str(value)))
    return f"`{value}`" if said is None else f'`"{said}"`'


def _heading(key: str, properties: Mapping[str, Any]) -> str:
    """A table as it stands in a case: ``[[keep]]`` where there may be many."""
    if _many(properties[key]):
        return f"[[{key}]]"
    return f"[{key}.NAME]" if "additionalProperties" in properties[key] else f"[{key}]"


def _many(value: Mapping[str, Any]) -> bool:
    """Whether a key holds a list."""
    return any(option.get("type") == "array" for option in (value, *value.get("anyOf", ())))


def _place(name: str, used: Mapping[str, str], properties: Mapping[str, Any]) -> tuple[int, str]:
    """Sections of a case in their order, then the tables inside them by name."""
    return (list(properties).index(used[name]) if name in used else len(properties), name)


def _reference(value: Mapping[str, Any]) -> str:
    """Name of the section that a key holds, itself or in an array; empty where none."""
    inner = (value, value.get("items") or {}, value.get("additionalProperties") or {})
    options = [*inner, *value.get("anyOf", ())]
    found = [o["$ref"].rpartition("/")[2] for o in options if isinstance(o, dict) and "$ref" in o]
    return found[0] if found else ""


def _described(value: Mapping[str, Any]) -> str:
    words = value.get("description", "")
    example = next(iter(value.get("examples", ())), None)
    return f"{words} Such as `{example}`." if example is not None else words


def _kind(value: Mapping[str, Any]) -> str:
    """Type of a value in a word or two."""
    if name := _reference(value):
        return f"list of {name}" if _many(value) else name
    if "enum" in value:
        return ", ".join(f"`{one}`" for one in value["enum"])
    if "anyOf" in value:
        kinds = dict.fromkeys(_kind(o) for o in value["anyOf"] if o.get("type") != "null")
        return " or ".join(kinds)
    return str(value.get("type", "any")) if "const" not in value else f"`{value['const']}`"


def _sentence(text: str) -> str:
    return " ".join(text.replace("``", "`").replace("|", "\\|").split())


def commands() -> Iterator[str]:
    """Every command with its arguments and options, from the command line itself."""
    yield "# Commands\n\nAs `gradedesign COMMAND --help` says them.\n"
    group = typer.main.get_command(app)
    for name in sorted(group.list_commands(None)):
        command = group.get_command(None, name)
        yield f"## gradedesign {name}\n\n{_sentence(command.help or '')}\n"
        yield "| Argument or option | Meaning |\n|---|---|"
        for option in command.params:
            if getattr(option, "hidden", False):
                continue
            named = option.opts if option.param_type_name == "option" else [option.name.upper()]
            yield f"| `{', '.join(named)}` | {_sentence(getattr(option, 'help', None) or '')} |"
        yield ""


def hooks() -> Iterator[str]:
    """Every hook with its example."""
    yield "# Hooks\n\n[How to write a plugin](../how-to/plugins.md) shows them at work.\n"
    for name in sorted(vars(hookspecs)):
        if name.startswith("gradedesign_"):
            yield f"::: gradedesign.plugin.hookspecs.{name}\n"


def api() -> Iterator[str]:
    """The public names of the package, by where their docstrings are."""
    yield "# Public API\n\nWhat scripts and plugins import; everything else may change.\n"
    for name in gradedesign.__all__:
        thing = getattr(gradedesign, name)
        # Constants and aliases do not know where they are.
        home = f"gradedesign.{gradedesign._MODULES[name]}"
        module = getattr(thing, "__module__", None) or home
        if module.startswith("gradedesign"):
            yield f"::: {module}.{getattr(thing, '__qualname__', name)}\n"
    for module in ("gradedesign.fields", "gradedesign.testing"):
        yield f"::: {module}\n"


def rooms() -> Iterator[str]:
    """The packages in the order in which they may import each other, with their first line."""
    tree = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    (order,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ORDER"
    )
    yield "| Room | Content |\n|---|---|"
    for name in order:
        path = ROOT / "src" / "gradedesign" / name
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if path.is_file():
            words = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
            yield f"| `{name}` | {_sentence(words.partition(chr(10))[0])} |"
