"""Records of what was measured that a case names by ``file``: data of a process, of a material.

A TOML file with the tables ``[process]`` and ``[material]``, whose keys are those of the tables of
a case, beside ``[fitted]``, which says how they were found and is not read.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError, ValidationInfo

from gradedesign.common.values.problems import dotted, problems_of
from gradedesign.common.values.suggest import instead
from gradedesign.common.values.table import Table, key_error
from gradedesign.geometry.part.part_schema import data_file

#: Bytes of a record, which has some kB. Chosen, not measured.
_LARGEST = 1_000_000
_TABLES = ("process", "material", "fitted")


def with_record(
    value: Any,
    info: ValidationInfo,
    table: str,
    layout: type[Table],
    *,
    texts: tuple[str, ...] = (),
) -> Any:
    """Keys of a table of a case with those that its ``file`` states; as it is without one.

    Raises a problem at ``file`` for what is wrong with the record, and at a key that is stated
    beside it.

    ``table``: name of the table in the record. ``layout``: of its keys. ``texts``: keys of the
    record alone, which the case has not.
    """
    if not isinstance(value, dict) or "file" not in value:
        return value
    for key in value:
        if key in layout.model_fields and key != "file":
            raise key_error(key, "found beside file, which states it; expected one of them")
    try:
        path = data_file(value["file"], info, "m290-ti64.toml", (".toml",))
        stated = {k: v for k, v in recorded(path, table).items() if k not in texts}
    except ValueError as error:
        raise key_error("file", str(error)) from None
    if "file" in stated:
        raise key_error("file", f"{path.name}: {table}.file: a record names no other record")
    try:
        layout.model_validate(stated)
    except ValidationError as error:
        found = problems_of(error.errors(include_url=False), prefix=(), layout=layout)
        words = "; ".join(f"{dotted((table, *p.key))}: {p.text()}" for p in found)
        raise key_error("file", f"{path.name}: {words}") from None
    return {**stated, **value, "file": path}


def recorded(path: Path, table: str) -> Mapping[str, Any]:
    """A table of a record as TOML gives it.

    Raises `ValueError` if the file cannot be read, is no such record, or has no such table.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
        data = tomllib.loads(content.decode("utf-8-sig")) if len(content) <= _LARGEST else None
    except OSError as error:
        raise ValueError(f"{path.name}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path.name}: not a record in TOML: {str(error)[:200]}") from None
    if data is None:
        raise ValueError(
            f"{path.name}: more than {_LARGEST} bytes; expected a record, which has some thousand"
        )
    for name in data:
        if name not in _TABLES:
            raise ValueError(f"{path.name}: found {name!r}; {instead(name, _TABLES)}")
    found = data.get(table)
    if not isinstance(found, dict) or not found:
        raise ValueError(
            f"{path.name}: has no table [{table}]; expected a record such as `gradedesign coupon` "
            f"writes from its sheet, with what was measured"
        )
    return found
