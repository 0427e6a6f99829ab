"""Pages of the site that are made from the code: case keys, commands, hooks, API, rooms.

mkdocs calls `on_files`; nothing here is imported by gradedesign.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

import gradedesign
from gradedesign.common.values.toml_text import toml_value
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.design.case.schema import CaseFile, schema_json
from gradedesign.program.commands.app import app
from gradedesign.program.host import hookspecs
from gradedesign.program.host.read_case import brought_by

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
        "notebooks/case-to-verdict.md": notebook_page("case-to-verdict"),
        "notebooks/own-cell.md": notebook_page("own-cell"),
        "notebooks/homogenise-and-choose.md": notebook_page("homogenise-and-choose"),
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
    """Every table of a case file with its keys, from the schema that reads it."""
    schema = schema_json(CaseFile, brought_by(None))
    yield "# Case keys\n\nWritten from the schema that reads case files; unknown keys are errors."
    yield "Tables inside tables may be written in one line as well: `[lattice.drain]` with"
    yield '`diameter = "3 mm"` below it is `drain = {diameter = "3 mm"}` in `[lattice]`.'
    yield "`NAME` is a name of your own; `[[...]]` stands once for every entry of a list.\n"
    yield from units(schema["definitions"])
    yield from dict(case_blocks(schema)).values()


def units(definitions: Mapping[str, Any]) -> Iterator[str]:
    """The units of every quantity that a key takes."""
    yield "## Units\n\nA quantity is a text in quotes: a number, a blank and a unit.\n"
    yield "| Quantity | Units | Magnitudes | Example |\n|---|---|---|---|"
    wanted = (DIMENSIONS[name] for name in dict.fromkeys(_dimensions(definitions)))
    for one in {dimension.phrase: dimension for dimension in wanted}.values():
        named = ", ".join(f"`{unit}`" for unit in one.units)
        yield f'| {_noun(one.phrase)} | {named} | between {one.span}, or 0 | `"{one.example}"` |'
    yield ""


def case_blocks(
    schema: Mapping[str, Any], table: Mapping[str, Any] | None = None, name: str = ""
) -> Iterator[tuple[str, str]]:
    """Tables and keys of a case file by their dotted names, with what the page says of them.

    Parameters
    ----------
    schema : mapping
        Of the whole file.
    table : mapping, optional
        Schema of the table whose keys are wanted; the whole file without it.
    name : str
        Dotted name of that table.
    """
    below = schema if table is None else table
    if table is not None:
        for key, value in below["properties"].items():
            text = "\n".join(_key(schema, key, value, key in _needed(below)))
            yield f"{name}.{key}", f"### `{name}.{key}`\n\n{text}"
    for key, value in below["properties"].items():
        for inner in _references(value):
            body = schema["definitions"][inner]
            named = f"{name}.{key}".strip(".") + (".NAME" * ("additionalProperties" in value))
            title = f"[[{named}]]" if _many(value) else f"[{named}]"
            needed = ""
            if table is None and key in schema.get("required", ()):
                needed = " Required."
            elif table is None and key in CaseFile.analysed:
                needed = " Required, unless the density of the lattice is stated."
            yield title, f"## {title}\n\n{_sentence(body.get('description', ''))}{needed}\n"
            yield from case_blocks(schema, body, named)


def _needed(table: Mapping[str, Any]) -> list[str]:
    """Keys of a table that it needs, at least by default."""
    return [*table.get("required", ()), *table.get("else", {}).get("required", ())]


def _key(
    schema: Mapping[str, Any], key: str, value: Mapping[str, Any], needed: bool
) -> Iterator[str]:
    """Meaning of a key; type, unit, range, default and an example."""
    about = (schema["definitions"][name].get("description", "") for name in _references(value))
    yield _sentence(value.get("description") or next(about, "")) + "\n"
    unit = " and ".join(dict.fromkeys(DIMENSIONS[d].unit for d in _dimensions(value)))
    stated = f"`{toml_value(value['default'])}`" if "default" in value else "none"
    yield "| Type | Unit | Range | Default | Example |\n|---|---|---|---|---|"
    yield (
        f"| {_kind(value)} | {unit or 'none'} | {_range(value)} | "
        f"{'required' if needed else stated} | "
        f"`{key} = {toml_value(_example(schema['definitions'], value))}` |\n"
    )


def _dimensions(value: Any) -> Iterator[str]:
    """Dimensions of the quantities in a value, as they come."""
    if isinstance(value, dict) and "x-dimension" in value:
        yield value["x-dimension"]
    for inner in value.values() if isinstance(value, dict) else value:
        if isinstance(inner, dict | list):
            yield from _dimensions(inner)


def _options(value: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The forms that a value may have."""
    return [option for option in value.get("anyOf", (value,)) if option.get("type") != "null"]


def _many(value: Mapping[str, Any]) -> bool:
    """Whether a key holds a list."""
    return any(option.get("type") == "array" for option in _options(value))


def _references(value: Mapping[str, Any]) -> list[str]:
    """Definitions of the tables that a key holds, itself, in a list or by name."""
    held = ((o, o.get("items"), o.get("additionalProperties")) for o in _options(value))
    found = [i["$ref"] for inner in held for i in inner if isinstance(i, dict) and "$ref" in i]
    return [reference.rpartition("/")[2] for reference in dict.fromkeys(found)]


def _example(definitions: Mapping[str, Any], value: Mapping[str, Any]) -> Any:
    """A value as a case may state it: an example, the other word, the default, or its entries'."""
    for stated in (value, *(_options(value))):
        if "examples" in stated:
            return stated["examples"][0]
    first = _options(value)[0]
    if "enum" in first:
        return next((w for w in first["enum"] if w != value.get("default")), first["enum"][0])
    if first.get("type") == "boolean":
        return not value.get("default", False)
    if "default" in value:
        return value["default"]
    if "$ref" in first:
        return _example(definitions, definitions[first["$ref"].rpartition("/")[2]])
    if "properties" in first:
        needed = {key: first["properties"][key] for key in first.get("required", ())}
        return {key: _example(definitions, inner) for key, inner in needed.items()}
    return [_example(definitions, first["items"])]


def _kind(value: Mapping[str, Any]) -> str:
    """Type of a value in words."""
    words = []
    for option in _options(value):
        if "x-dimension" in option:
            words.append(_noun(DIMENSIONS[option["x-dimension"]].phrase))
        elif "$ref" in option or option.get("type") == "object":
            words.append("table")
        elif option.get("type") == "array":
            words.append(_list_kind(option))
        else:
            words.append("word" if "enum" in option or "const" in option else KINDS[option["type"]])
    return " or ".join(dict.fromkeys(words))


#: Types of JSON schema in the words of people who write cases.
KINDS = {
    "string": "text",
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
}


def _list_kind(value: Mapping[str, Any]) -> str:
    """Type of a list in words: how many of which."""
    if isinstance(value["items"], list):
        return "pair of " + " and ".join(_kind(item) for item in value["items"])
    inner = _kind(value["items"])
    head, of, rest = inner.partition(" of ")
    plural = f"{head}s{of}{rest}" if head in ("list", "pair") else f"{inner}s"
    least, most = value.get("minItems"), value.get("maxItems")
    count = f"{most} " if least == most else f"{least} to {most} "
    return f"list of {count if most else ''}{plural}"


def _range(value: Mapping[str, Any]) -> str:
    """Values that are allowed, in words."""
    return "; or ".join(dict.fromkeys(_option_range(option) for option in _options(value)))


def _option_range(value: Mapping[str, Any]) -> str:
    if "x-range" in value:
        return str(value["x-range"])
    words = value.get("enum", [value["const"]] if "const" in value else ())
    if words:
        return ", ".join(f"`{word}`" for word in words)
    if "$ref" in value:
        return "as its keys"
    if value["type"] == "array":
        items = value["items"] if isinstance(value["items"], list) else [value["items"]]
        return ", ".join(_range(item) for item in items)
    if "maxLength" in value:
        return f"{value['minLength']} to {value['maxLength']} characters"
    bounds = [f"{word} {value[key]:g}" for key, word in BOUNDS.items() if key in value]
    return " and ".join(bounds) or UNBOUNDED[value["type"]]


#: Bounds of JSON schema in words.
BOUNDS = {
    "exclusiveMinimum": "above",
    "minimum": "at least",
    "exclusiveMaximum": "below",
    "maximum": "at most",
}
UNBOUNDED = {
    "number": "any number",
    "string": "any text",
    "boolean": "`true`, `false`",
    "object": "any names",
}


def _noun(phrase: str) -> str:
    """A phrase without its article."""
    return phrase.partition(" ")[2]


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
            yield f"::: gradedesign.program.host.hookspecs.{name}\n"


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


def notebook_page(name: str) -> str:
    """Cells and stored outputs of a notebook."""
    text = (ROOT / "docs" / "notebooks" / f"{name}.ipynb").read_text(encoding="utf-8")
    notebook = json.loads(text)
    return "\n\n".join(part for cell in notebook["cells"] for part in _cell_parts(cell)) + "\n"


def _cell_parts(cell: dict[str, Any]) -> Iterator[str]:
    source = "".join(cell["source"])
    if cell["cell_type"] == "markdown":
        yield source
        return
    yield f"```python\n{source}\n```"
    for output in cell["outputs"]:
        data = output.get("data", {})
        if "image/png" in data:
            source = f"data:image/png;base64,{data['image/png']}"
            yield f'<img alt="Picture of what the cell above shows" src="{source}">'
        elif "text/html" in data:
            yield "".join(line.strip() for line in data["text/html"])
        else:
            yield f"```text\n{''.join(data.get('text/plain') or output.get('text', ()))}\n```"


def rooms() -> Iterator[str]:
    """The rooms in the order in which they may import each other: what they hold, their doors."""
    tree = ast.parse((ROOT / "tests" / "test_architecture.py").read_text(encoding="utf-8"))
    (order,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ROOMS"
    )
    yield "| Room | Content | Door |\n|---|---|---|"
    for name in order:
        path = ROOT / "src" / "gradedesign" / name
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if path.is_file():
            words = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
            first, _, rest = words.partition("\n")
            door = rest.partition("Door: ")[2].partition("\n\n")[0].replace("\n", " ")
            yield f"| `{name}` | {_sentence(first)} | {door} |"
