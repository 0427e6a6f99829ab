"""Problems of a case file, each at its key, reported together with file and line."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from gradedesign.common.values.suggest import instead, meant, shown
from gradedesign.common.values.table import Table
from gradedesign.common.values.toml_lines import Key, line_of
from gradedesign.errors import CaseError

#: Problems that fit on one screen; the others often follow from these. Chosen, not measured.
_MOST_LISTED = 40
#: Tables in tables whose keys are looked for. Chosen, not measured.
_DEEPEST = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something wrong at one key."""

    key: Key  #: Path of the key in the file.
    #: What was found and what would be right. Nearest spellings are looked up in ``choices`` only
    #: when the problem is reported, since a hostile file can have thousands.
    message: str
    word: str = ""  #: The wrong word to compare with ``choices``.
    choices: tuple[str, ...] = ()  #: Words that could be meant.
    label: str = ""  #: Heading of the list of choices.
    missing: bool = False  #: Whether the key is not there.

    def text(self) -> str:
        """The message with the nearest spelling and the choices."""
        if not self.label:
            return self.message
        return f"{self.message}; {instead(self.word, self.choices, label=self.label)}"


def dotted(key: Key) -> str:
    """Write a key path as ``load_case[0].load[1].force``."""
    text = ""
    for part in key:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        plain = part if len(part) <= 60 and part.isprintable() else shown(part)
        text += f".{plain}" if text else plain
    return text


def case_error(path: Path, lines: Mapping[Key, int], problems: Sequence[Problem]) -> CaseError:
    """Error that lists every problem of a case file, in the order of the file.

    Returns CaseError: a summary line, then one line per problem: file, line, key, message.
    """
    lines_by_key = dict(lines)
    ordered = sorted(problems, key=lambda p: line_of(lines_by_key, p.key))
    listed = [placed(path, lines_by_key, p) for p in ordered[:_MOST_LISTED]]
    if len(ordered) > _MOST_LISTED:
        listed.append(f"{path.name}: and {len(ordered) - _MOST_LISTED} more problems")
    count = "1 problem" if len(ordered) == 1 else f"{len(ordered)} problems"
    return CaseError("\n".join([f"{path}: {count} in the case file", *listed]))


def placed(path: Path, lines: Mapping[Key, int], problem: Problem) -> str:
    """A problem with the file and line of its key."""
    line = line_of(dict(lines), problem.key)
    return f"{path.name}:{line}: {dotted(problem.key)}: {problem.text()}"


def problems_of(
    errors: Sequence[ErrorDetails], *, prefix: Key, layout: type[BaseModel]
) -> Iterator[Problem]:
    """Translate pydantic's errors.

    ``errors``: ``ValidationError.errors()``. ``prefix``: key of the validated value in the file.
    ``layout``: layout of the whole file, to look up what a table may hold.
    """
    problems = []
    for error in errors:
        key = (*prefix, *(part for part in error["loc"] if part != "[key]"))
        problems.append(_problem(error, key, layout))
    yield from without_meant(problems)


def without_meant(problems: Sequence[Problem]) -> Iterator[Problem]:
    """Drop problems of missing keys that a misspelt key beside them explains."""
    stated = {(*p.key[:-1], word) for p in problems if p.word for word in meant(p.word, p.choices)}
    yield from (p for p in problems if not (p.missing and p.key in stated))


def _problem(error: ErrorDetails, key: Key, layout: type[BaseModel]) -> Problem:
    kind, context = error["type"], error.get("ctx", {})
    if kind == "value_error":
        return Problem(key=key, message=str(context["error"]))
    if kind == "at_key":
        return Problem(key=(*key, context["key"]), message=str(context["message"]))
    if kind == "extra_forbidden":
        table = _table_at(layout, key[:-1])
        return unknown(layout, table, key, tuple(_fields(table)), "key")
    if kind == "missing":
        return missing(key, _fields(_table_at(layout, key[:-1])).get(str(key[-1])))
    value = shown(error["input"])
    example = _example(_table_at(layout, key))
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        such = f" such as {example}" if example else ""
        return Problem(key=key, message=f"found {value}; expected a table{such}")
    if kind == "tuple_type":
        write = f": write [[{key[-1]}]]" if len(key) == 1 else f": write {key[-1]} = [{example}]"
        return Problem(key=key, message=f"found {value}; expected a list of tables{write}")
    return Problem(key=key, message=f"found {value}; {error['msg']}")


def unknown(
    layout: type[BaseModel],
    table: type[BaseModel] | None,
    key: Key,
    choices: tuple[str, ...],
    noun: str,
) -> Problem:
    """Problem of an unknown key or table, with the names that other programs give it."""
    word = str(key[-1])
    if table is not None and issubclass(table, Table):
        if word in table.replaced:
            return Problem(key=key, message=table.replaced[word])
        word = table.called.get(word.lower(), word)
    return Problem(
        key=key,
        message=f"unknown {noun}" + elsewhere(layout, word, choices),
        word=word,
        choices=choices,
        label=f"valid {noun}s",
    )


def elsewhere(layout: type[BaseModel], word: str, choices: tuple[str, ...]) -> str:
    """Say which other tables have a key; empty if one of the choices is meant."""
    if meant(word, choices):
        return ""
    names = {word, word.removesuffix("s"), f"{word}s"}
    homes = [(home, key) for home, key in _keys(layout, (), _DEEPEST) if key in names]
    if not homes:
        return ""
    told = " and ".join(f"[{dotted(home)}] has {key}" for home, key in homes[:2])
    return f", but {told}: write it there"


def _keys(model: type[BaseModel], path: Key, depth: int) -> Iterator[tuple[Key, str]]:
    """Tables below a model with their keys."""
    for name, field in _fields(model).items():
        for table in _models(field.annotation):
            for key in _fields(table):
                yield (*path, name), key
            if depth > 1:
                yield from _keys(table, (*path, name), depth - 1)


def missing(key: Key, field: FieldInfo | None) -> Problem:
    """Problem of a key that must be there and is not."""
    if len(key) == 1:
        many = field is not None and get_origin(field.annotation) is tuple
        add = f"[[{key[0]}]]" if many else f"[{key[0]}]"
        return Problem(key=key, message=f"missing; add {add}", missing=True)
    value = "" if field is None else _example_value(field)
    add = f"; add {key[-1]} = {value}" if value else ""
    return Problem(key=key, message=f"missing{add}", missing=True)


def _example(model: type[BaseModel] | None) -> str:
    """A table in one line: its example, or the keys that it needs; empty without any."""
    if model is None:
        return ""
    if issubclass(model, Table) and model.example:
        return model.example
    stated = [
        f"{name} = {value}"
        for name, field in _fields(model).items()
        if field.is_required() and (value := _example_value(field))
    ]
    return "{" + ", ".join(stated) + "}" if stated else ""


def _example_value(field: FieldInfo) -> str:
    """A value of a key as it is written; empty where neither it nor its table has an example."""
    if field.examples:
        # the texts and lists of JSON are written alike in TOML
        return json.dumps(field.examples[0])
    return _example(next(_models(field.annotation), None))


def is_key(layout: type[BaseModel], text: str) -> bool:
    """Whether a text is the dotted path of a key that a file of a layout may have."""
    first, *rest = (part.partition("[")[0] for part in text.split("."))
    if first not in layout.model_fields:
        return False
    return not rest or rest[-1] in _fields(_table_at(layout, (first, *rest[:-1])))


def _table_at(layout: type[BaseModel], key: Key) -> type[BaseModel] | None:
    """Find the model of the table at a key, or None."""
    annotation: Any = layout
    for part in key:
        model = next(_models(annotation), None)
        if isinstance(part, int):
            continue  # an entry of a list: the annotation of the list names its model
        field = _fields(model).get(part)
        if field is not None:
            annotation = field.annotation
        elif model is None:
            return None
        # else a name of the user's own, as in [region.tip]: the mapping names the model
    return next(_models(annotation), None)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models(argument)


def _fields(model: type[BaseModel] | None) -> dict[str, FieldInfo]:
    if model is None:
        return {}
    return {field.alias or name: field for name, field in model.model_fields.items()}
