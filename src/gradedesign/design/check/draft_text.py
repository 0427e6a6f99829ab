"""Text of a drafted case: regions, answers, proposals with their reasons, "?" for what is open."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from gradedesign.common.values.toml_text import toml_value
from gradedesign.common.values.value_types import Quantity
from gradedesign.design.case.read_case import NO_VALUES
from gradedesign.design.check.check_case import CaseCheck
from gradedesign.design.check.draft_case import DraftCase
from gradedesign.design.resolve.load_balance import PLATE


class Key(StrEnum):
    """Keys of a case that may be answered, in the order in which they are asked."""

    MATERIAL = "material.name"
    HELD = "load_case[0].fix"
    LOADED = "load_case[0].load"
    FACTOR = "limits.safety_factor"
    MOVED = "limits.displacement"
    WALL = "print.min_wall"
    CELL = "lattice.cell"
    SIZE = "lattice.size"


#: As they stand where nobody has answered.
_OPEN: Mapping[str, Any] = {
    Key.MATERIAL: "?",
    Key.HELD: [{"region": "?"}],
    Key.LOADED: [{"region": "?", "force": ["? N", "? N", "? N"]}],
    Key.CELL: "?",
}
#: Thickness of solid members over the edge of a cell: with half of the part's mean thickness for
#: a cell, a quarter of that. Chosen, not measured.
_MEMBER = 0.5


def draft_text(
    draft: DraftCase,
    name: str,
    file_name: str,
    answers: Mapping[str, Any] = NO_VALUES,
    checked: CaseCheck | None = None,
) -> str:
    """The case file of a draft.

    ``name``: of the case. ``file_name``: of the part, beside the case file. ``answers``: by key of
    `Key`, as TOML has them, each one found right. ``checked``: the check of that case, if whole.
    """
    given = {**_OPEN, **answers}
    more = "".join(f"{key} = {toml_value(value)}\n" for key, value in draft.stated.items())
    regions = "\n\n".join(f"[region.{key}]\n{text}" for key, text in draft.lines.items())
    todo = "Leave out the regions that nothing needs, then: gradedesign preview, run"
    if not is_whole(answers):
        todo = 'State what stands as "?", leave out the regions that nothing needs, then: '
        todo += "gradedesign check"
    return f"""\
# {todo}
[case]
name = {toml_value(name)}

[part]
file = {toml_value(file_name)}
{more}
# Faces that may be held or loaded.
{regions or "# None was found: see docs/parts.md for how regions are picked."}

[material]
name = {toml_value(given[Key.MATERIAL])}  # gradedesign materials lists them

{_plates(draft, answers)}
[[load_case]]
name = "load"
fix = {toml_value(given[Key.HELD])}
load = {toml_value(given[Key.LOADED])}

[limits]
{_limits(answers)}
{_printer(answers)}
[lattice]
cell = {toml_value(given[Key.CELL])}  # gradedesign cells lists them
{_sizes(draft, answers)}{"" if checked is None else _window(checked)}"""


def is_whole(answers: Mapping[str, Any]) -> bool:
    """Whether a draft with these answers leaves nothing open that a case needs."""
    limited = Key.FACTOR in answers or Key.MOVED in answers
    return limited and all(key in answers for key in _OPEN)


def _window(checked: CaseCheck) -> str:
    """Line of the densities that a checked case leaves, and what ends them."""
    (low, high), plan = checked.run.bounds, checked.plan
    begins = {
        "the cell hangs together": plan.cell.window[0],
        "its law begins": plan.law.window[0],
        "walls are thick enough for [print]": plan.bounds[0],
        "[run] memory and time resolve the walls": low,
    }
    why = max(begins, key=lambda words: round(begins[words], 6))
    ends = "its law" if plan.law.window[1] < plan.cell.window[1] else "the cell"
    window = [float(f"{value:.3g}") for value in (low, high)]
    return f"# density = {window}  # from where {why}, to where {ends} ends\n"


def _plates(draft: DraftCase, answers: Mapping[str, Any]) -> str:
    """Solid behind loaded faces and held holes, where open lattice would give way."""
    held = [entry["region"] for entry in answers.get(Key.HELD, ())]
    named = [name for name in held if name in draft.shapes]
    named += [entry["region"] for entry in answers.get(Key.LOADED, ())]
    title = "# Solid behind faces that are bolted or loaded, one table each"
    if not named:
        return f'{title}:\n# [[keep]]\n# region = "?"\n# margin = "2 mm"\n'
    margin = f"{PLATE * _edge(draft, answers):.2g} mm"
    tables = (
        f"[[keep]]\nregion = {toml_value(name)}\nmargin = {toml_value(margin)}\n"
        for name in dict.fromkeys(named)
    )
    why = "a sixth of a cell spans its openings"
    return f"{title}; {why}.\n" + "".join(tables)


def _limits(answers: Mapping[str, Any]) -> str:
    """Keys of ``[limits]``: a safety factor, unless displacements alone are limited."""
    factor, moved = answers.get(Key.FACTOR, "?"), answers.get(Key.MOVED)
    lines = f"safety_factor = {toml_value(factor)}  # a number, on the yield strength\n"
    if Key.FACTOR not in answers and moved is not None:
        lines = "# safety_factor = 2  # on the yield strength\n"
    if moved is not None:
        return f"{lines}displacement = {toml_value(moved)}\n"
    example = [{"region": "?", "magnitude": "? mm"}]
    if Key.LOADED in answers:
        example = [{"region": answers[Key.LOADED][0]["region"], "magnitude": "2 x solid"}]
    return f"{lines}# displacement = {toml_value(example)}\n"


def _printer(answers: Mapping[str, Any]) -> str:
    """``[print]`` with the thinnest wall; in a comment where it is not known."""
    mark, wall = ("", answers[Key.WALL]) if Key.WALL in answers else ("# ", "0.8 mm")
    note = "the thinnest that the printer makes: from there the densities begin"
    return f"{mark}[print]\n{mark}min_wall = {toml_value(wall)}  # {note}\n"


def _sizes(draft: DraftCase, answers: Mapping[str, Any]) -> str:
    """Size of the cells and what may stand among them, each with its reason."""
    edge = _edge(draft, answers)
    size = toml_value(answers.get(Key.SIZE, f"{edge:g} mm"))
    if Key.SIZE not in answers:
        size += "  # half of the part's mean thickness: two cells across"
    least, why = _MEMBER * edge, "half a cell"
    if Key.WALL in answers and (wall := Quantity("length").read(answers[Key.WALL])) > least:
        least, why = wall, "as thick as the printer's thinnest wall"
    return f"""\
size = {size}
phases = ["lattice", "solid"]  # filled; members of solid where these are lighter than cells
least_member = {toml_value(f"{least:.3g} mm")}  # of these members: {why}
"""


def _edge(draft: DraftCase, answers: Mapping[str, Any]) -> float:
    """Edge of a cell, mm."""
    return Quantity("length").read(answers[Key.SIZE]) if Key.SIZE in answers else draft.cell_size


#: What to write for each "?" of a drafted case, by the keys that hold one.
_EXPECTED = {
    "keep[0].region": "where wanted: a region that stays solid, by its name",
    "material.name": 'a material that `gradedesign materials` lists, such as "Ti-6Al-4V"',
    "load_case[0].fix[0].region": "the region that is held, by its name",
    "load_case[0].load[0].region": "the region that is loaded, by its name",
    "load_case[0].load[0].force": 'force along x, y and z, such as ["0 N", "0 N", "-500 N"]',
    "limits.safety_factor": "a number above 1, such as 2: yield strength over stress",
    "limits.displacement[0].region": "where wanted: the region whose displacement is limited",
    "limits.displacement[0].magnitude": 'with it: how far it may move, such as "0.1 mm"',
    "lattice.cell": "a cell that `gradedesign cells` lists, by its name",
}
_TABLE = re.compile(r"(?:# )?(\[+)(\w+)\]+")
_ENTRY = re.compile(r'(\w+) = \[?"\?')


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenQuestion:
    """A "?" in a drafted case: its line, its key and how to answer it."""

    line: int
    key: str
    expected: str


def open_questions(text: str) -> tuple[OpenQuestion, ...]:
    """Every "?" of a drafted case `draft_text`, those in comments included, line by line."""
    found, table = [], ""
    for line, row in enumerate(text.splitlines(), start=1):
        header = _TABLE.match(row)
        if header:
            table = header[2] + ("[0]" if len(header[1]) > 1 else "")
        outer = row.removeprefix("# ").partition(" = ")[0]
        for name in _ENTRY.findall(row):
            key = f"{table}.{name}" if name == outer else f"{table}.{outer}[0].{name}"
            if key in _EXPECTED:  # else a name that begins with it
                found.append(OpenQuestion(line=line, key=key, expected=_EXPECTED[key]))
    return tuple(found)
