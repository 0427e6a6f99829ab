"""Reading a case file: from TOML to a checked :class:`Case`, or every problem at once.

Above 300 lines: the checks across tables read like the one list that they are.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from pydantic import TypeAdapter, ValidationError

from gradedesign.common.values.key_path import parse_key, with_values
from gradedesign.common.values.plugins_by_name import supplied_by
from gradedesign.common.values.problems import (
    Problem,
    case_error,
    dotted,
    missing,
    placed,
    problems_of,
    unknown,
    without_meant,
)
from gradedesign.common.values.suggest import instead
from gradedesign.common.values.table import Table
from gradedesign.common.values.toml_lines import Key, key_lines
from gradedesign.common.values.toml_mistakes import mistake, unclosed
from gradedesign.design.case.checks import case_warnings, cross_problems, reference_problems
from gradedesign.design.case.schema import Brought, Case, CaseFile, with_brought
from gradedesign.errors import CaseError
from gradedesign.geometry.cell.own_cell_schema import own_cell_file
from gradedesign.geometry.lattice.density_value import states_density
from gradedesign.geometry.lattice.lattice_schema import LatticeSpec
from gradedesign.geometry.part.part_path import slices_with
from gradedesign.geometry.part.part_schema import PartSpec
from gradedesign.geometry.part.place_schema import PlaceSpec
from gradedesign.mechanics.limits.limits_schema import LimitsSpec

log = logging.getLogger(__name__)

#: Bytes of a case file, which has a few kB: a larger file is some other one. Chosen, not measured.
_LARGEST = 1_000_000
_FILE_NAME = "case.toml"
_OR_STATED = ", or state the density of the lattice, such as density = 0.3"
_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


#: A case as its file states it.
NO_VALUES: Mapping[str, Any] = MappingProxyType({})

#: Keys that plugins bring; called only where a file names one.
_BroughtKeys: TypeAlias = Callable[[], Brought]


def load_case(
    path: str | Path,
    *,
    allow_outside: bool = False,
    brought: _BroughtKeys = Brought,
    values: Mapping[str, Any] = NO_VALUES,
) -> Case:
    """Read and check a case file; as `gradedesign.load_case`, for keys of plugins that are given.

    Raises `CaseError` with a summary and one line per problem: file, line, key, what was found,
    what would be right.
    """
    content, file, lines = _read_tables(
        path, allow_outside=allow_outside, brought=brought, values=values
    )
    tables = {name: getattr(content, name) for name in CaseFile.model_fields if name != "case"}
    case = Case(
        name=content.case.name,
        path=file,
        folder=file.parent,
        case_hash=case_hash(
            content,
            file,
            *part_files(content.part),
            *_body_files(*content.keep, *content.zone),
            *lattice_files(content.lattice),
        ),
        warnings=tuple(placed(file, lines, problem) for problem in case_warnings(content)),
        lines={dotted(key): line for key, line in lines.items()},
        **tables,
    )
    for warning in case.warnings:
        log.warning("%s", warning)
    return case


class _KindsAskedFor(Exception):  # noqa: N818  control flow of `require_case_text`, never seen outside
    """The case names a key that only an installed plugin can read."""


def require_case_text(path: str | Path, *, allow_outside: bool) -> None:
    """Refuse a case by its text alone, before plugins and solvers are loaded.

    Nothing is refused here where the text names a key of limits, part or lattice that plugins may
    bring:
    those who load the plugins read it again.

    Raises CaseError with every problem.
    """

    def ask() -> Brought:
        raise _KindsAskedFor

    with contextlib.suppress(_KindsAskedFor):
        _read_tables(path, allow_outside=allow_outside, brought=ask)


def _read_tables(
    path: str | Path,
    *,
    allow_outside: bool,
    brought: _BroughtKeys,
    values: Mapping[str, Any] = NO_VALUES,
) -> tuple[CaseFile, Path, dict[Key, int]]:
    """Tables of a case file, its absolute path, and the line of every key; see `load_case`."""
    file = case_file(Path(path))
    data, lines = read_toml(file)
    data = with_values(data, values)
    layout = with_brought(CaseFile, _named_keys(data, brought))
    content, problems = _validate(data, file.parent, layout, allow_outside=allow_outside)
    problems.extend(reference_problems(data))
    if content is not None:
        problems.extend(cross_problems(content))
    if content is None or problems:
        raise case_error(file, lines, problems)
    return content, file, lines


def problems_at(data: Mapping[str, Any], key: str) -> list[str]:
    """Problems at one dotted key of a case, and below it; others may be open still.

    ``data``: as TOML gives it.
    """
    path = parse_key(key)
    _, problems = _validate(data, Path(), CaseFile, allow_outside=False)
    problems.extend(reference_problems(data))
    return [problem.text() for problem in problems if problem.key[: len(path)] == path]


def read_toml(file: Path) -> tuple[dict[str, Any], dict[Key, int]]:
    """Content of a TOML file of at most 1 MB, and the line of every key.

    Raises `CaseError` if it cannot be read, is no TOML, or is nested beyond what any case needs.
    """
    try:
        text = _read_text(file)
        try:
            lines = key_lines(text)
        except CaseError as error:
            raise CaseError(f"{file}: {error}") from None
        return _parse(text, file), lines
    except CaseError as error:
        if file.suffix.lower() == ".toml":
            raise
        raise CaseError(
            f"{error}\nis {file.name} the file of a part? `gradedesign new` begins a case with one"
        ) from None


def _named_keys(data: Mapping[str, Any], brought: _BroughtKeys) -> Brought:
    """Keys of plugins that a file names; all of a table's if it has an unknown key.

    What is installed beside them does not change the identity of a case.
    """
    limits, part = _more_keys(data, "limits", LimitsSpec), _more_keys(data, "part", PartSpec)
    lattice = _more_keys(data, "lattice", LatticeSpec)
    if not limits and not part and not lattice:
        return Brought()
    every = brought()
    return Brought(
        limits=_named(every.limits, limits),
        part=_named(every.part, part),
        lattice=_named(every.lattice, lattice),
    )


def _of_plugin(problem: Problem) -> Problem:
    """A problem, with the plugin of this project that would know its key."""
    plugin = supplied_by("keys", dotted(problem.key)) if problem.label else ""
    return Problem(key=problem.key, message=f"unknown key; {plugin}") if plugin else problem


def _more_keys(data: Mapping[str, Any], name: str, layout: type[Table]) -> set[str]:
    """Keys of a table of the file that are not the core's."""
    own = {field.alias or key for key, field in layout.model_fields.items()}
    return set(data[name]) - own if isinstance(data.get(name), dict) else set()


def _named(every: Mapping[str, Any], keys: set[str]) -> dict[str, Any]:
    return {key: table for key, table in every.items() if key in keys or keys - set(every)}


def case_file(path: Path) -> Path:
    """The case file, absolute, of its path or of its folder's.

    Raises `CaseError` if there is none.
    """
    try:
        file = path / _FILE_NAME if path.is_dir() else path
        if not file.exists():
            beside = file.parent.iterdir() if file.parent.is_dir() else ()
            names = sorted(p.name for p in beside if p.suffix == ".toml")
            guess = instead(file.name, names, label="case files there")
            raise CaseError(
                f"{file}: no such case file; {guess}; `gradedesign new` begins one from a part"
            )
        if not file.is_file():
            raise CaseError(f"{file}: not a regular file; expected a case file in TOML")
        return file.absolute()
    except (OSError, ValueError) as error:
        # ValueError is a path with a zero byte
        raise CaseError(f"{str(path)!r}: cannot be read as a case file: {error}") from None


def _read_text(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except OSError as error:
        raise CaseError(f"{file}: cannot be read: {error.strerror}") from None
    if len(content) > _LARGEST:
        raise CaseError(f"{file}: larger than 1 MB; expected a case file of a few kB")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise CaseError(
            f"{file}:{line}: not UTF-8 text, byte {content[error.start]:#04x}; save the file as "
            "UTF-8"
        ) from None
    return text.replace("\r\n", "\n")


def _parse(text: str, file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise CaseError(f"{file}: nested too deeply") from None
    except ValueError as error:
        # TOMLDecodeError, or a whole number of thousands of digits
        raise CaseError(_syntax_message(str(error), text, file)) from None


def _syntax_message(message: str, text: str, file: Path) -> str:
    match = _PLACE.search(message)
    if match is None:
        return f"{file}: not valid TOML: {message}"
    rows = text.split("\n")
    row = int(match[1]) if match[1] else len(rows)
    column = int(match[2]) if match[2] else len(rows[-1]) + 1
    start = max(0, column - 60)
    shown_row = "".join(c if c.isprintable() else " " for c in rows[row - 1][start : start + 100])
    caret = " " * (column - 1 - start) + "^"
    reason = message[: match.start()]
    begun = unclosed(rows, row - 1) + 1
    if begun < row:
        what = rows[begun - 1].strip()
        hint = mistake(reason, rows, begun - 1) or "what opens there has no end"
        return f"{file}:{begun}: not valid TOML: {reason}: {hint}\n    {what[:100]}"
    if hint := mistake(reason, rows, row - 1):
        reason = f"{reason}: {hint}"
    return f"{file}:{row}:{column}: not valid TOML: {reason}\n    {shown_row}\n    {caret}"


def _validate(
    data: Mapping[str, Any], folder: Path, layout: type[CaseFile], *, allow_outside: bool
) -> tuple[CaseFile | None, list[Problem]]:
    """Check every section by itself, so that one wrong section hides no other's problems."""
    context = {"folder": folder, "allow_outside": allow_outside}
    problems = list(_unknown_sections(data, layout))
    sections: dict[str, Any] = {}
    needed = {name for name, field in layout.model_fields.items() if field.is_required()}
    if not states_density(data.get("lattice")):
        needed |= set(layout.analysed)
    none_of_them = not set(layout.analysed) & set(data)
    for name, field in layout.model_fields.items():
        if name not in data:
            if name in needed:
                problem = missing((name,), field)
                if name in layout.analysed and none_of_them:
                    problem = replace(problem, message=problem.message + _OR_STATED)
                problems.append(problem)
            continue
        try:
            sections[name] = _adapter(layout, name).validate_python(data[name], context=context)
        except ValidationError as error:
            errors = error.errors(include_url=False)
            problems.extend(problems_of(errors, prefix=(name,), layout=layout))
    if "load_case" in needed and not sections.get("load_case", True):
        problems.append(missing(("load_case",), layout.model_fields["load_case"]))
    if problems:
        return None, [_of_plugin(problem) for problem in without_meant(problems)]
    return layout(**sections), problems


def _unknown_sections(data: Mapping[str, Any], layout: type[CaseFile]) -> Iterator[Problem]:
    section_names = tuple(layout.model_fields)
    for name in data:
        if name not in section_names:
            yield unknown(layout, layout, (name,), section_names, "table")


@cache
def _adapter(layout: type[CaseFile], section: str) -> TypeAdapter[Any]:
    annotation: Any = layout.model_fields[section].annotation
    return TypeAdapter(annotation)


def part_files(part: PartSpec) -> list[Path]:
    """Files that the part is read from: one, or all images of a stack."""
    return [] if part.file is None else slices_with(part.file)


def lattice_files(lattice: LatticeSpec) -> list[Path | None]:
    """Files of directions, of a density map and of a cell of its own."""
    turned, stated = lattice.orientation, lattice.density_map
    files = [turned.vtu if turned else None, own_cell_file(lattice)]
    if stated is not None and stated.images is not None:
        files += sorted(path for path in stated.images.iterdir() if path.is_file())
    elif stated is not None:
        files += [stated.voxels, stated.points, stated.vtu]
    return files


def _body_files(*places: PlaceSpec) -> list[Path]:
    """Files of bodies, in the order of their places."""
    return [p.body.file for p in places if p.body is not None and p.body.file is not None]


def case_hash(content: Table, file: Path, *read: Path | None) -> str:
    """Hash of a case's content and of the files it is read from, whatever its place and spelling.

    Budgets of time, memory and iterations do not count, nor do the price of other bodies and the
    formats that are written: with more of them, or without one that cannot be written, a run that
    ended early resumes from the stages it finished.

    Raises CaseError if a file cannot be read.

    ``content``: with a table ``part``; the path of its file does not count. ``file``: the case
    file, for messages. ``*read``: files whose bytes and suffix count.
    """
    specification = content.model_dump(
        mode="json",
        exclude={
            "output": True,
            "part": {"file"},
            "material": {"file"},
            "process": {"file"},
            "run": {"time", "memory", "max_iterations", "price"},
            "lattice": {
                "own_cell": {"file"},
                "orientation": {"vtu"},
                "density_map": {"voxels", "images", "points", "vtu"},
            },
            "keep": {"__all__": {"body": {"file"}}},
            "zone": {"__all__": {"body": {"file"}}},
        },
    )
    digest = hashlib.sha256()
    canonical = json.dumps(specification, sort_keys=True, separators=(",", ":"), allow_nan=False)
    digest.update(canonical.encode())
    for source in read:
        if source is None:
            continue
        try:
            with source.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
        except OSError as error:
            raise CaseError(f"{file}: {source} cannot be read: {error.strerror}") from None
        digest.update(source.suffix.lower().encode())
    return digest.hexdigest()
