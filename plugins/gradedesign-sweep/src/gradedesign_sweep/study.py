"""Reading a study: its designs in order, each with its values and its case."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from pydantic import ValidationError

from gradedesign import CaseError, load_case
from gradedesign.commands import (
    Case,
    Key,
    Problem,
    Registry,
    case_error,
    case_file,
    dotted,
    parse_key,
    problems_of,
    read_toml,
    shown,
)
from gradedesign_sweep.study_schema import StudyFile

#: Designs of one study at most.
_MOST_DESIGNS = 1000

#: Values by dotted key, as TOML gives them.
Values: TypeAlias = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Design:
    """One design of a study.

    Attributes
    ----------
    number : int
        From 1, in the order of the study.
    values : mapping of dotted key to value
        Put in place of those of the base case.
    """

    number: int
    values: Mapping[str, Any]
    case: Case

    @property
    def label(self) -> str:
        """Its values, as a person names it: those of lengths and names say what they are."""
        return ", ".join(value_text(value) for value in self.values.values())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """A study as read.

    Attributes
    ----------
    base : Path
        The base case file, absolute.
    keys : tuple of str
        Dotted keys that vary, in the order of the study.
    """

    name: str
    base: Path
    keys: tuple[str, ...]
    designs: tuple[Design, ...]


def load_study(path: Path, registry: Registry, *, allow_outside: bool = False) -> Study:
    """Read a study and the case of every design.

    Parameters
    ----------
    path : Path
        The study file.
    registry : Registry
        Kinds of limits.
    allow_outside : bool
        Whether cases may name files outside the folder of the base case.

    Raises
    ------
    CaseError
        If the file is no study; a key is none of the case; a list is empty; there is nothing to
        vary, or more than `_MOST_DESIGNS` designs; a design is no valid case, or the same as
        another one.
    """
    file = Path(path).absolute()
    try:
        there = file.is_file()
    except OSError as error:
        raise CaseError(f"{path}: cannot be read as a study: {error.strerror}") from None
    if not there:
        raise CaseError(f"{path}: no such file; expected a study in TOML")
    data, lines = read_toml(file)
    content = _content(file, data, lines)
    base = case_file(file.parent / content.study.case)
    every = _designs_of(file, content, lines)
    designs = tuple(
        Design(
            number=number,
            values=values,
            case=_case(file, base, number, values, registry, allow_outside=allow_outside),
        )
        for number, values in enumerate(every, start=1)
    )
    _require_difference(file, designs)
    keys = tuple(dict.fromkeys(key for values in every for key in values))
    return Study(name=content.study.name, base=base, keys=keys, designs=designs)


def value_text(value: Any) -> str:
    """A value of a case in a table: texts as they are, anything else as JSON.

    Examples
    --------
    >>> value_text("10 mm"), value_text([0.2, 0.6])
    ('10 mm', '[0.2, 0.6]')
    """
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _content(file: Path, data: Mapping[str, Any], lines: Mapping[Key, int]) -> StudyFile:
    try:
        return StudyFile.model_validate(data)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        problems = list(problems_of(errors, prefix=(), layout=StudyFile))
        raise case_error(file, lines, problems) from None


def _designs_of(file: Path, content: StudyFile, lines: Mapping[Key, int]) -> list[Values]:
    """Values of every design: the combinations of the lists, for each of the rows.

    Raises
    ------
    CaseError
        For anything but lists of values, one that is empty, a key of both, none or too many.
    """
    lists = dict(_leaves(content.vary))
    rows = [dict(_leaves(row)) for row in content.design] or [{}]
    problems = [*_wrong_lists(lists), *_wrong_rows(content, lists)]
    if problems:
        raise case_error(file, lines, problems)
    count = len(rows)
    for values in lists.values():
        count *= len(values)
    if not lists and not content.design:
        raise CaseError(
            f'{file}: nothing to vary; add [vary] with lists such as "lattice.size" = '
            f'["10 mm", "12 mm"], or [[design]] tables'
        )
    if count > _MOST_DESIGNS:
        each = " x ".join(str(n) for n in (len(rows), *map(len, lists.values())) if n > 1)
        raise CaseError(
            f"{file}: {each} = {count} designs; expected {_MOST_DESIGNS} at most: shorten a list, "
            f"or split the study"
        )
    return [
        {**row, **dict(zip(lists, chosen, strict=True))}
        for row in rows
        for chosen in itertools.product(*lists.values())
    ]


def _leaves(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Values by dotted key: ``lattice.cell = 1`` without quotes is a table in a table to TOML."""
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _wrong_lists(lists: Mapping[str, Any]) -> Iterator[Problem]:
    """Lists of values that are none, or empty."""
    for key, values in lists.items():
        if not isinstance(values, list):
            yield Problem(
                key=("vary", key), message=f"found {shown(values)}; expected a list of values"
            )
        elif not values:
            yield Problem(
                key=("vary", key), message="an empty list; expected a value or more, or no key"
            )


def _wrong_rows(content: StudyFile, lists: Mapping[str, Any]) -> Iterator[Problem]:
    """Rows that say nothing, or what the lists say too."""
    for number, row in enumerate(content.design):
        if not row:
            yield Problem(
                key=("design", number), message="an empty table; expected keys of the case"
            )
        for key, _ in _leaves(row):
            if key in lists:
                yield Problem(
                    key=("design", number, key),
                    message="is in [vary] too; expected it in one place",
                )


def _case(
    file: Path,
    base: Path,
    number: int,
    values: Values,
    registry: Registry,
    *,
    allow_outside: bool,
) -> Case:
    """The case of one design.

    Raises
    ------
    CaseError
        With the number and values of the design.
    """
    try:
        return load_case(base, allow_outside=allow_outside, registry=registry, values=values)
    except CaseError as error:
        stated = ", ".join(f"{key} = {value_text(value)}" for key, value in values.items())
        raise CaseError(f"{file}: design {number} ({stated}): {error}") from error


def _require_difference(file: Path, designs: Sequence[Design]) -> None:
    """Raise where two designs are one.

    Raises
    ------
    CaseError
        With their numbers.
    """
    seen: dict[str, int] = {}
    for design in designs:
        first = seen.setdefault(design.case.case_hash, design.number)
        if first != design.number:
            raise CaseError(
                f"{file}: designs {first} and {design.number} ask for the same; expected values "
                f"that differ in more than spelling, budgets of [run] (time, memory, "
                f"max_iterations) and [output]"
            )


def key_names(study: Study) -> dict[str, str]:
    """Short names of the keys that vary: the last part where that is enough to tell them apart.

    Examples
    --------
    >>> key_names(Study(name="s", base=Path(), keys=("lattice.size", "part.mesh_size"), designs=()))
    {'lattice.size': 'size', 'part.mesh_size': 'mesh_size'}
    """
    last = {key: dotted(parse_key(key)[-1:]) for key in study.keys}
    return {k: v if list(last.values()).count(v) == 1 else k for k, v in last.items()}
