"""Texts that a user types for a new case, in options or in the dialogue, as values of its keys.

Nothing is judged here: the values go through what reads a case.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gradedesign.common.values.key_path import with_values
from gradedesign.common.values.suggest import shown
from gradedesign.design.case.read_case import problems_at
from gradedesign.design.check.draft_case import DraftCase
from gradedesign.design.check.draft_text import Key, draft_text
from gradedesign.design.resolve.registry import Kind, Registry, lookup
from gradedesign.errors import CaseError


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """An option that answers a question, and how its text is written."""

    name: str
    form: str


#: By key of the case, in its order.
OPTIONS: Mapping[str, Option] = {
    Key.MATERIAL: Option(name="--material", form="a name that `gradedesign materials` lists"),
    Key.HELD: Option(name="--fix", form="a region of the part by its name"),
    Key.LOADED: Option(name="--load", form="REGION=FX,FY,FZ in N, such as {region}=0,0,-500"),
    Key.FACTOR: Option(name="--safety-factor", form="a number such as 2"),
    Key.MOVED: Option(
        name="--displacement",
        form="REGION=LENGTH in mm, such as {region}=0.1, or {region}=2 x solid for twice what the "
        "solid part gives way",
    ),
    Key.WALL: Option(name="--min-wall", form="a length in mm, such as 0.8"),
    Key.CELL: Option(name="--cell", form="a name that `gradedesign cells` lists"),
    Key.SIZE: Option(name="--size", form="a length in mm, such as 8"),
}
#: Keys whose value is the name of something installed.
_NAMES: Mapping[str, Kind] = {Key.MATERIAL: "materials", Key.CELL: "cell_families"}


def typed_by_key(*texts: str | Sequence[str] | None) -> dict[str, list[str]]:
    """Texts for each of `Key`, in their order."""
    return {
        key: [text] if isinstance(text, str) else list(text or ())
        for key, text in zip(Key, texts, strict=True)
    }


def read_answer(
    key: str,
    texts: Sequence[str],
    draft: DraftCase,
    registry: Registry,
    answers: Mapping[str, Any],
) -> Any:
    """The value of a key as TOML has it, of what was typed for it.

    Raises CaseError, with what to type, where reading a case with the answers so far refuses it.
    """
    option = OPTIONS[key]
    form = option.form.format(region=next(iter(draft.regions), "tip"))
    try:
        value = _value(key, texts)
        data = tomllib.loads(draft_text(draft, "new", "part", answers))
        refused = "; ".join(problems_at(with_values(data, {key: value}), key))
        if not refused and key in _NAMES:
            lookup(registry, _NAMES[key], value)
    except CaseError as error:
        refused = str(error)
    if refused:
        raise CaseError(f"{option.name}: {refused}; type {form}")
    return value


def read_answers(
    typed: Mapping[str, Sequence[str]], draft: DraftCase, registry: Registry
) -> dict[str, Any]:
    """Values of all keys that something was typed for; as `read_answer`."""
    answers: dict[str, Any] = {}
    for key in Key:
        if typed.get(key):
            answers[key] = read_answer(key, typed[key], draft, registry, answers)
    return answers


def _value(key: str, texts: Sequence[str]) -> Any:
    """The value that texts stand for; lists take several."""
    if key == Key.HELD:
        return [{"region": text} for text in texts]
    if key == Key.LOADED:
        return [
            {"region": region, "force": [_with_unit(part, "N") for part in _parts(force)]}
            for region, force in map(_pair, texts)
        ]
    if key == Key.MOVED:
        return [
            {"region": region, "magnitude": _with_unit(length, "mm")}
            for region, length in map(_pair, texts)
        ]
    if key == Key.FACTOR:
        return texts[0] if (number := _number(texts[0])) is None else number
    return _with_unit(texts[0], "mm") if key in (Key.WALL, Key.SIZE) else texts[0]


def _pair(text: str) -> tuple[str, str]:
    """A region and what is stated of it."""
    region, sign, rest = text.rpartition("=")
    if not sign:
        raise CaseError(f"found {shown(text)}; expected a sign = after the region")
    return region.strip(), rest.strip()


def _parts(text: str) -> list[str]:
    return re.split(r"\s*,\s*" if "," in text else r"\s+", text)


def _with_unit(text: str, unit: str) -> str:
    """A quantity in the unit that was asked for, unless another one is typed."""
    return text if _number(text) is None else f"{text} {unit}"


def _number(text: str) -> float | None:
    """A plain number, a whole one without its point; None of any other text."""
    try:
        number = float(text)
    except ValueError:
        return None
    return int(number) if number.is_integer() else number


def needed() -> str:
    """Options without which a case stays open."""
    keys = (Key.MATERIAL, Key.HELD, Key.LOADED, Key.FACTOR, Key.CELL)
    return ", ".join(OPTIONS[key].name for key in keys)
