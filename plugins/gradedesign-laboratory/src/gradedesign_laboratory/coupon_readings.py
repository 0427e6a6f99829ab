"""Measurements of coupons, read from their sheet."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

from gradedesign import CaseError
from gradedesign.commands import instead, shown
from gradedesign_laboratory.coupon_numbers import Numbers, Problems
from gradedesign_laboratory.coupon_sheet import (
    CHECK,
    COLUMNS,
    FILLED_FACTS,
    FORMAT,
    PLATE_FACTS,
    REMARKS,
    PlateFacts,
    checksum,
)
from gradedesign_laboratory.measured_coupons import MeasuredBlock, MeasuredStrut, Readings

#: Bytes of a sheet, which has some kB. Chosen, not measured.
_LARGEST = 1_000_000
#: Text of a fact, longest: names of machines and days.
_LONGEST = 80


def read_sheet(path: Path) -> Readings:
    """Read a sheet that is filled in.

    Raises
    ------
    CaseError
        With a line for every problem: row, column, what was found and what was expected.
    """
    return readings_of(_text(path), path.name)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except (OSError, ValueError) as error:
        raise CaseError(f"{path}: cannot be read: {error}") from None
    if len(content) > _LARGEST:
        raise CaseError(f"{path}: larger than 1 MB; expected the sheet of a plate, of some kB")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(
            f"{path}: not UTF-8 text, byte {content[error.start]:#04x}; save it as CSV UTF-8, not "
            f"as a workbook"
        ) from None


def readings_of(text: str, name: str) -> Readings:
    """Read a sheet from its text; ``name`` is that of its file, for messages.

    Raises CaseError as `read_sheet`.
    """
    problems = Problems(name)
    lines = _table(text, name)
    facts, body = _split(lines, problems)
    header_line, header = body[0]
    _require_columns(header, header_line, problems)
    problems.require_none()
    rows = [(line, _named(header, row)) for line, row in body[1:]]
    numbers = Numbers(problems, comma=any(_has_comma(row) for _, row in rows))
    struts: dict[tuple[int, int], MeasuredStrut] = {}
    blocks: dict[int, MeasuredBlock] = {}
    first: dict[tuple[int, int], int] = {}
    for line, row in rows:
        before = len(problems.found)
        coupon = numbers.whole(line, row, "coupon")
        kind = row["kind"].strip()
        strut = numbers.whole(line, row, "strut") if kind == "strut" else 0
        if kind not in ("strut", "block"):
            problems.add(line, f"kind: found {shown(kind)}; expected block or strut")
        elif len(problems.found) == before:
            if (coupon, strut) in first:
                problems.add(
                    line,
                    f"coupon {coupon}{f', strut {strut}' if strut else ''}: stands in line "
                    f"{first[coupon, strut]} already; expected one row for each",
                )
            first.setdefault((coupon, strut), line)
            if kind == "strut":
                struts[coupon, strut] = numbers.strut(line, row, coupon, strut)
            else:
                blocks[coupon] = numbers.block(line, row, coupon)
    gauge = numbers.gauge(facts)
    machine, day = _filled(facts, problems)
    problems.require_none()
    stated = {key: facts[key][1] for key in PLATE_FACTS}
    if facts[CHECK][1] != checksum(stated, [row for _, row in rows]):
        problems.add(
            facts[CHECK][0],
            "what the plate states has changed: its first lines, or columns "
            "coupon to compressed_ratio, or rows are missing or added; expected them as they were "
            "written, with blanks for what was not measured",
        )
    problems.require_none()
    return Readings(
        facts=PlateFacts(**stated),
        machine=machine,
        day=day,
        gauge=gauge,
        struts=tuple(struts[key] for key in sorted(struts)),
        blocks=tuple(blocks[key] for key in sorted(blocks)),
    )


def _table(text: str, name: str) -> list[tuple[int, list[str]]]:
    """Rows of a text with their lines, by the separator of its header; blank ones left out."""
    header = next(
        (row for row in text.splitlines() if row.strip() and not row.lstrip('"').startswith("#")),
        "",
    )
    separator = max(",;\t", key=header.count)
    reader = csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True)
    rows = []
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise CaseError(
            f"{name}:{reader.line_num}: not a row of values: {error}; expected CSV, as it was "
            f"written"
        ) from None
    if not rows or tuple(rows[0][1][:2]) != FORMAT:
        raise CaseError(
            f"{name}: does not begin with {shown(', '.join(FORMAT))}; expected a sheet that "
            f"`gradedesign coupon` wrote"
        )
    return rows


def _split(
    rows: Sequence[tuple[int, list[str]]], problems: Problems
) -> tuple[dict[str, tuple[int, str]], Sequence[tuple[int, list[str]]]]:
    """Facts by name, each with its line, and the header with the rows below it."""
    facts: dict[str, tuple[int, str]] = {}
    names = (*PLATE_FACTS, *FILLED_FACTS, CHECK)
    k = 1
    while k < len(rows) and rows[k][1][0].startswith("#"):
        line, cells = rows[k]
        name = cells[0].lstrip("# ")
        if name not in names:
            problems.add(line, f"found {shown(cells[0])}; {instead(name, names)}")
        elif name in facts:
            problems.add(line, f"{name}: stated twice")
        elif any(cells[2:]):
            problems.add(
                line, f"{name}: found several values, {shown(', '.join(cells[1:]))}; expected one"
            )
        else:
            facts[name] = line, cells[1] if len(cells) > 1 else ""
        k += 1
    for name in names:
        if name not in facts:
            problems.add(rows[min(k, len(rows)) - 1][0], f"the line '# {name}' is missing")
    if k >= len(rows) - 1:
        problems.add(rows[-1][0], "no header with rows below it was found")
    problems.require_none()
    return facts, rows[k:]


def _require_columns(header: Sequence[str], line: int, problems: Problems) -> None:
    """Every column once, no other; their units are part of their names."""
    for name in COLUMNS:
        if header.count(name) > 1:
            problems.add(line, f"column {name} stands there twice")
    for name in header:
        if name and name not in COLUMNS:
            problems.add(line, f"found column {shown(name)}; {instead(name, COLUMNS)}")
    for name in COLUMNS:
        if name not in header and name != REMARKS:
            problems.add(line, f"column {name} is missing")


def _named(header: Sequence[str], row: Sequence[str]) -> dict[str, str]:
    """Cells by column; those beyond the header by their place."""
    cells = [*row, *[""] * (len(header) - len(row))]
    named = {name: cell for name, cell in zip(header, cells, strict=False) if name}
    beyond = [cell for k, cell in enumerate(cells) if cell and (k >= len(header) or not header[k])]
    return {**named, **({"": ", ".join(beyond)} if beyond else {})}


def _has_comma(row: Mapping[str, str]) -> bool:
    """Whether a number of a row has a decimal comma."""
    return any("," in cell for name, cell in row.items() if name not in ("", REMARKS))


def _filled(facts: Mapping[str, tuple[int, str]], problems: Problems) -> tuple[str, str]:
    """Machine and day, which the record states."""
    line, machine = facts["machine"]
    if not machine:
        problems.add(line, "machine: blank; expected its name, such as EOS M 290")
    elif len(machine) > _LONGEST or not machine.isprintable() or machine[0] in "=+@-":
        problems.add(line, f"machine: found {shown(machine)}; expected the name of a machine")
    line, day = facts["date"]
    try:
        day = date.fromisoformat(day).isoformat()
    except ValueError:
        problems.add(
            line,
            f"date: {f'found {shown(day)}' if day else 'blank'}; expected year, month and day as "
            f"in 2026-11-27",
        )
    return machine, day
