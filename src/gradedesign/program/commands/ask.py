"""The dialogue of ``gradedesign new`` on a terminal: every question with a proposal and its reason.

An answer is what the option of the same key takes; numbers stand for names of the tables above.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from gradedesign.common.values.suggest import instead, shown
from gradedesign.design.check.draft_case import DraftCase
from gradedesign.design.check.draft_text import Key
from gradedesign.design.check.proposals import Proposal, Proposals
from gradedesign.design.resolve.registry import Registry
from gradedesign.errors import CaseError
from gradedesign.program.commands.answers import read_answer
from gradedesign.program.commands.show import print_table, print_text

#: Cells that are listed. Chosen, not measured.
_MOST_CELLS = 6
_NO_LIMIT = "no limit, the safety factor alone decides"


def on_terminal() -> bool:
    """Whether somebody can be asked."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def ask_line(words: str, proposal: Proposal | None = None) -> str:
    """Ask one question; what was typed, or else what is proposed.

    Raises EOFError where the input ends.
    """
    print_text(words)
    if proposal is not None:
        name = f"{proposal.name}, " if proposal.name else ""
        print_text(f"  Enter: {name}{proposal.why}", hang=4)
    return input("> ").strip() or ("" if proposal is None else proposal.name)


def ask_answers(
    draft: DraftCase, registry: Registry, on_answer: Callable[[Mapping[str, Any]], None]
) -> dict[str, list[str]]:
    """Ask what only the user knows; texts by key, as options take them.

    Where the input ends, what is left stays open.

    ``on_answer``: gets the answers so far, as values of the case.
    """
    asking = _Asking(draft=draft, registry=registry, on_answer=on_answer)
    if not draft.regions:
        print_text("No face was found that may be held or loaded; docs/parts.md says how to pick.")
        return {}
    print_text(
        "Numbers stand for names of the tables. What is typed is checked at once; the case file "
        "holds every answer as soon as it is given. Ctrl-D leaves the rest open."
    )
    try:
        for key in Key:
            _ASK[key](asking)
    except EOFError:
        print_text("")
    return asking.typed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Asking:
    """A dialogue, with what was answered so far."""

    draft: DraftCase
    registry: Registry
    on_answer: Callable[[Mapping[str, Any]], None]
    typed: dict[str, list[str]] = field(default_factory=dict)
    answers: dict[str, Any] = field(default_factory=dict)

    @property
    def proposals(self) -> Proposals:
        """Proposals for this part."""
        return Proposals(draft=self.draft, registry=self.registry)

    @property
    def regions(self) -> list[str]:
        """Names in the order of the printed table."""
        return sorted(self.draft.regions)

    def take(self, key: str, texts: Sequence[str]) -> bool:
        """Whether texts answer a question; else says why not."""
        try:
            self.answers[key] = read_answer(key, texts, self.draft, self.registry, {**self.answers})
        except CaseError as error:
            print_text(str(error), hang=2)
            return False
        self.typed[key] = list(texts)
        self.on_answer(self.answers)
        return True

    def ask(
        self,
        key: str,
        words: str,
        proposal: Proposal | None = None,
        texts: Callable[[str], Sequence[str]] = lambda line: [line],
    ) -> None:
        """Ask until the answer is one, or what is proposed is to state nothing."""
        line = ask_line(words, proposal)
        while (line or proposal is None) and not self.take(key, texts(line)):
            line = ask_line(words, proposal)


def _named(line: str, names: Sequence[str]) -> str:
    """A name, typed or by its number."""
    number = int(line) if line.isdecimal() and len(line) <= len(str(len(names))) else 0
    return names[number - 1] if 0 < number <= len(names) else line


def _each(line: str, names: Sequence[str]) -> list[str]:
    return [_named(word, names) for word in line.replace(",", " ").split()] or [""]


def _material(asking: _Asking) -> None:
    materials = asking.registry.materials
    print_table(
        "Materials",
        ("#", "material", "E GPa", "yield MPa", "g/cm^3"),
        [
            (str(n), name, f"{m.youngs_modulus / 1e3:.4g}", f"{m.yield_strength:.4g}",
             f"{m.density * 1e9:.4g}")
            for n, (name, m) in enumerate(materials.items(), start=1)
        ],
    )  # fmt: skip
    proposal = asking.proposals.material()
    asking.ask(Key.MATERIAL, "Material?", proposal, lambda line: [_named(line, list(materials))])


def _held(asking: _Asking) -> None:
    words = "Where is the part held? One region or several, with commas between them."
    proposal = asking.proposals.support()
    asking.ask(Key.HELD, words, proposal, lambda line: _each(line, asking.regions))


def _loaded(asking: _Asking) -> None:
    """Regions with a force each, until none is named."""
    held = {entry["region"] for entry in asking.answers[Key.HELD]}
    proposal = asking.proposals.load(held)
    words = "Which region is loaded?"
    done: list[str] = []
    while (line := ask_line(words, proposal)) or not done:
        region = _named(line, asking.regions)
        if region not in asking.regions:
            print_text(f"no region {shown(region)}; {instead(region, asking.regions)}", hang=2)
            continue
        force = f"Force on {region} along x, y and z in N, such as 0, 0, -500?"
        while not asking.take(Key.LOADED, [*done, f"{region}={ask_line(force)}"]):
            pass
        done = asking.typed[Key.LOADED]
        words = "Which other region is loaded at the same time?"
        proposal = Proposal(name="", why="no other")


def _factor(asking: _Asking) -> None:
    proposal = Proposal(name="2", why="half of the yield strength may be used")
    asking.ask(Key.FACTOR, "Safety factor on the yield strength?", proposal)


def _moved(asking: _Asking) -> None:
    """A limit of displacement for each loaded region, where one is wanted."""
    typed, proposal = asking.typed, Proposal(name="", why=_NO_LIMIT)
    for region in dict.fromkeys(entry["region"] for entry in asking.answers[Key.LOADED]):
        words = f"How far may {region} move, in mm? Or 2 x solid: twice what the solid part does."
        start = [*typed.get(Key.MOVED, ()), f"{region}="]
        asking.ask(Key.MOVED, words, proposal, partial(_continued, start))


def _continued(start: Sequence[str], line: str) -> list[str]:
    return [*start[:-1], start[-1] + line]


def _wall(asking: _Asking) -> None:
    words = "Thinnest wall that the printer makes, in mm? The least density follows from it."
    asking.ask(Key.WALL, words, Proposal(name="", why="not stated, the cell alone sets it"))


def _cell(asking: _Asking) -> None:
    proposals = asking.proposals.cells()
    print_table(
        "Cells, the strongest first; `gradedesign cells` lists all",
        ("#", "cell", "strength"),
        [(str(n), p.name, p.why) for n, p in enumerate(proposals[:_MOST_CELLS], start=1)],
    )
    names = [p.name for p in proposals]
    asking.ask(Key.CELL, "Cell?", next(iter(proposals), None), lambda line: [_named(line, names)])


def _size(asking: _Asking) -> None:
    size = f"{asking.draft.cell_size:g} mm"
    why = f"{size}, half of the part's mean thickness: two cells across"
    asking.ask(Key.SIZE, "Size of a cell, in mm?", Proposal(name="", why=why))


_ASK: Mapping[str, Callable[[_Asking], None]] = {
    Key.MATERIAL: _material,
    Key.HELD: _held,
    Key.LOADED: _loaded,
    Key.FACTOR: _factor,
    Key.MOVED: _moved,
    Key.WALL: _wall,
    Key.CELL: _cell,
    Key.SIZE: _size,
}
