"""Questions that a drafted case leaves: each "?" with its line, its key and what to write."""

from __future__ import annotations

import re
from dataclasses import dataclass

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
            found.append(OpenQuestion(line=line, key=key, expected=_EXPECTED[key]))
    return tuple(found)
