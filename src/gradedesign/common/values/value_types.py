"""Readers of single values: what a key of the case file accepts, and its message when it does not.

Each reader is put into ``Annotated[...]`` of a schema field. Pydantic calls ``read`` with what TOML
gave; :class:`Refused` becomes one problem with file, line and key.

Above 300 lines: one list of readers.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from pydantic import WithJsonSchema
from pydantic_core import core_schema

from gradedesign.common.values.quantity import number_in, parse_quantity
from gradedesign.common.values.suggest import instead, shown
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.errors import CaseError

Triple: TypeAlias = tuple[float, float, float]
#: Characters of a text in which the three edges of a size are looked for. Chosen, not measured.
_LONGEST_SIZE = 80
JsonSchema: TypeAlias = dict[str, Any]


class Refused(ValueError):  # noqa: N818  reported as a problem, never raised to the user
    """A value that is not what a key accepts; the message says what was found and expected."""


class Reader:
    """Base of the readers: turns ``read`` into a pydantic schema."""

    __slots__ = ()

    def read(self, value: object) -> object:
        """Convert one TOML value, or raise Refused with what was found and expected."""
        raise NotImplementedError

    def json_schema(self) -> JsonSchema:
        """JSON schema of the text that may be written.

        ``x-dimension`` names the dimension of quantities, ``x-range`` says in words what JSON
        schema has no word for; editors pass over both, the reference of the keys shows them.
        """
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, _source: Any, _handler: Any) -> Any:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, _schema: Any, _handler: Any) -> JsonSchema:
        return self.json_schema()


@dataclass(frozen=True, slots=True)
class Quantity(Reader):
    """A number with its unit; the bounds are in the internal unit."""

    dimension: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None

    def read(self, value: object) -> float:
        """Convert ``"5 kN"`` to 5000.0; what no part, load or material has is refused."""
        try:
            number = parse_quantity(value, self.dimension)
        except CaseError as error:
            raise Refused(str(error)) from None
        wanted = DIMENSIONS[self.dimension]
        small = (self.above is not None and not number > self.above) or (
            self.at_least is not None and number < self.at_least
        )
        large = self.at_most is not None and number > self.at_most
        if small or large:
            of = "" if self.at_least is None else "of "
            raise Refused(f"found {shown(value)}; expected {wanted.phrase} {of}{self.span}")
        if number != 0.0 and not wanted.least <= abs(number) <= wanted.most:
            raise Refused(
                f"found {shown(value)}; expected {wanted.phrase} between {wanted.span} in "
                f"magnitude; is its unit right?"
            )
        return number

    def json_schema(self) -> JsonSchema:
        """A string; the example shows the unit."""
        wanted = DIMENSIONS[self.dimension]
        return {
            "type": "string",
            "description": wanted.phrase,
            "examples": [wanted.example],
            "x-dimension": self.dimension,
            "x-range": self.span or "positive or negative",
        }

    @property
    def span(self) -> str:
        """The bounds in words; empty without any."""
        words = DIMENSIONS[self.dimension].words
        bounds = (("above", self.above), ("at least", self.at_least), ("at most", self.at_most))
        return " and ".join(f"{word} {words(end)}" for word, end in bounds if end is not None)


@dataclass(frozen=True, slots=True)
class Vector(Reader):
    """Three quantities of one dimension, along x, y and z; with ``one``, also one for all three."""

    dimension: str
    example: str = ""
    above: float | None = None
    one: bool = False

    def read(self, value: object) -> Triple:
        """Convert ``["0 N", "0 N", "-5 kN"]`` to a tuple."""
        reader = Quantity(self.dimension, above=self.above)
        if self.one and not isinstance(value, list):
            number = reader.read(value)
            return number, number, number
        example = self._meant(value) or self._example()
        x, y, z = (_entry(reader, i, v) for i, v in enumerate(three(value, example)))
        return x, y, z

    def json_schema(self) -> JsonSchema:
        """Three strings."""
        item = Quantity(self.dimension, above=self.above).json_schema()
        if self.one:
            return {"anyOf": [item, _array_of_three(item)]}
        return {**_array_of_three(item), "examples": [json.loads(self._example())]}

    def _example(self) -> str:
        return self.example or _along_z(DIMENSIONS[self.dimension].example)

    def _meant(self, value: object) -> str:
        """The list that one text stands for: a size such as 60 x 20 x 20 mm, or one component."""
        if not isinstance(value, str) or len(value) > _LONGEST_SIZE:
            return ""
        parts = re.split(r"\s*[x\u00d7,;]\s*", value)
        unit = re.sub(r"^[^A-Za-z]*", "", parts[-1])
        texts = [part if re.search("[A-Za-z]", part) else f"{part} {unit}" for part in parts]
        try:
            for text in texts:
                parse_quantity(text, self.dimension)
        except CaseError:
            return ""
        if len(texts) == 3:
            return "[" + ", ".join(f'"{text}"' for text in texts) + "]"
        return _along_z(value) if len(texts) == 1 and not self.example else ""


@dataclass(frozen=True, slots=True)
class Number(Reader):
    """A plain number, written without quotes."""

    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None

    def read(self, value: object) -> float:
        """Convert a TOML integer or float."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            number = number_in(value)
            write = "" if number is None else f": write {number:g}"
            raise Refused(f"found {shown(value)}; expected a plain number without quotes{write}")
        if isinstance(value, int) and abs(value) >= 10**18:
            raise Refused(f"found {shown(value)}; expected a smaller number")
        if not math.isfinite(value):
            raise Refused(f"found {shown(value)}; expected a finite number")
        check_range(
            float(value),
            shown(value),
            above=self.above,
            at_least=self.at_least,
            below=self.below,
            at_most=self.at_most,
        )
        return float(value)

    def json_schema(self) -> JsonSchema:
        """A number with its bounds."""
        bounds = {
            "exclusiveMinimum": self.above,
            "minimum": self.at_least,
            "exclusiveMaximum": self.below,
            "maximum": self.at_most,
        }
        return {"type": "number"} | {k: v for k, v in bounds.items() if v is not None}


@dataclass(frozen=True, slots=True)
class Whole(Reader):
    """A whole number between two bounds."""

    at_least: int
    at_most: int

    def read(self, value: object) -> int:
        """Convert a TOML integer."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise Refused(f"found {shown(value)}; expected a whole number without quotes")
        check_range(value, shown(value), at_least=self.at_least, at_most=self.at_most)
        return value

    def json_schema(self) -> JsonSchema:
        """An integer with its bounds."""
        return {"type": "integer", "minimum": self.at_least, "maximum": self.at_most}


class Flag(Reader):
    """``true`` or ``false``."""

    __slots__ = ()

    def read(self, value: object) -> bool:
        """Accept a TOML boolean."""
        if not isinstance(value, bool):
            raise Refused(f"found {shown(value)}; expected true or false without quotes")
        return value

    def json_schema(self) -> JsonSchema:
        """A boolean."""
        return {"type": "boolean"}


@dataclass(frozen=True, slots=True)
class Text(Reader):
    """A short printable text."""

    noun: str = "a name"
    longest: int = 120
    example: str = ""

    def read(self, value: object) -> str:
        """Accept a TOML string of 1 to ``longest`` printable characters."""
        if not isinstance(value, str):
            raise Refused(f"found {shown(value)}; expected {self.noun} in quotes")
        if not value.strip() or len(value) > self.longest or not value.isprintable():
            raise Refused(
                f"found {shown(value)}; expected {self.noun} of 1 to {self.longest} printable "
                "characters on one line"
            )
        return value

    def json_schema(self) -> JsonSchema:
        """A string."""
        examples = {"examples": [self.example]} if self.example else {}
        return {"type": "string", "minLength": 1, "maxLength": self.longest, **examples}


@dataclass(frozen=True, slots=True)
class Choice(Reader):
    """One word of a list; ``planned`` words are known but refused until they work."""

    words: tuple[str, ...]
    planned: tuple[str, ...] = ()

    def read(self, value: object) -> str:
        """Accept one of the words as spelled."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, str) and value in self.planned:
            raise Refused(f"found {shown(value)}, not there yet; {instead('', self.words)}")
        word = value if isinstance(value, str) else ""
        raise Refused(f"found {shown(value)}; {instead(word, self.words)}")

    def json_schema(self) -> JsonSchema:
        """An enumeration."""
        return {"enum": list(self.words)}


@dataclass(frozen=True, slots=True)
class Words(Reader):
    """One text or a list of texts, kept as a tuple."""

    noun: str = "a name"
    example: str = ""

    def read(self, value: object) -> tuple[str, ...]:
        """Convert ``"a"`` or ``["a", "b"]``."""
        if isinstance(value, str):
            return (Text(self.noun).read(value),)
        if not isinstance(value, list) or not value:
            raise Refused(f"found {shown(value)}; expected {self.noun} or a list of them")
        return tuple(_entry(Text(self.noun), i, v) for i, v in enumerate(value))

    def json_schema(self) -> JsonSchema:
        """A string or an array of strings."""
        text = Text(self.noun, example=self.example).json_schema()
        return {"anyOf": [text, {"type": "array", "items": text, "minItems": 1}]}


@dataclass(frozen=True, slots=True)
class Choices(Reader):
    """Words of a list, each once, kept as a tuple in the order of that list."""

    words: tuple[str, ...]

    def read(self, value: object) -> tuple[str, ...]:
        """Convert ``["a", "b"]``."""
        if not isinstance(value, list) or not value:
            raise Refused(f"found {shown(value)}; expected {self._example()}")
        words = [_entry(Choice(self.words), i, v) for i, v in enumerate(value)]
        if len(set(words)) < len(words):
            raise Refused(f"found {json.dumps(words)}; expected no word twice")
        return tuple(word for word in self.words if word in words)

    def json_schema(self) -> JsonSchema:
        """An array of the words."""
        return {
            "type": "array",
            "items": {"enum": list(self.words)},
            "minItems": 1,
            "uniqueItems": True,
        }

    def _example(self) -> str:
        return json.dumps(list(self.words))


def _along_z(text: str) -> str:
    """A list with one quantity as its last entry beside zeros of its unit."""
    zero = f'"0 {re.sub(r"^[^A-Za-z]*", "", text)}"'
    return f'[{zero}, {zero}, "{text}"]'


def three(value: object, example: str) -> list[object]:
    """Accept a list of exactly three entries, or raise Refused."""
    if not isinstance(value, list) or len(value) != 3:
        raise Refused(
            f"found {shown(value)}; expected three entries for x, y and z such as {example}"
        )
    return value


def check_range(
    number: float,
    shown_value: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> None:
    """Raise Refused unless a number lies inside its bounds."""
    stated = [
        (f"{word} {limit:g}", holds)
        for word, limit, holds in (
            ("above", above, above is None or number > above),
            ("at least", at_least, at_least is None or number >= at_least),
            ("below", below, below is None or number < below),
            ("at most", at_most, at_most is None or number <= at_most),
        )
        if limit is not None
    ]
    if not all(holds for _, holds in stated):
        wanted = " and ".join(words for words, _ in stated)
        share = 1.0 < number <= 100.0 and 1.0 in (below, at_most)
        per_cent = 0.0 < number <= 1.0 and at_most == 100.0
        meant = number / 100.0 if share else 100.0 * number
        told = f": write {meant:g} for {number:g} %" if share else ""
        told = f", in per cent: write {meant:g}" if per_cent else told
        raise Refused(f"found {shown_value}; expected a value {wanted}{told}")


def _entry(reader: Any, index: int, value: object) -> Any:
    try:
        return reader.read(value)
    except Refused as error:
        raise Refused(f"entry {index + 1}: {error}") from None


def _array_of_three(item: JsonSchema) -> JsonSchema:
    return {"type": "array", "items": item, "minItems": 3, "maxItems": 3}


Name: TypeAlias = Annotated[str, Text("a name", 80)]
RegionName: TypeAlias = Annotated[str, Text("the name of a region", 80, "tip")]
RegionNames: TypeAlias = Annotated[tuple[str, ...], Words("the name of a region", "tip")]
#: A path that its table finds from the folder of the case on.
FilePath: TypeAlias = Annotated[
    Path, WithJsonSchema({"type": "string", "x-range": "a path below the folder of the case"})
]
Size: TypeAlias = Annotated[float, Quantity("length", above=0.0)]
Distance: TypeAlias = Annotated[float, Quantity("length", at_least=0.0)]
Point: TypeAlias = Annotated[Triple, Vector("length")]


class Parameters(Reader):
    """Plain numbers by name."""

    __slots__ = ()

    def read(self, value: object) -> dict[str, float]:
        """Convert ``{offset = 0.2}``."""
        if not isinstance(value, dict):
            raise Refused(f"found {shown(value)}; expected a table such as {{offset = 0.2}}")
        numbers = {}
        for key, entry in value.items():
            try:
                numbers[key] = Number().read(entry)
            except Refused as error:
                raise Refused(f"{key}: {error}") from None
        return numbers

    def json_schema(self) -> JsonSchema:
        """A table of numbers."""
        number = {"type": "number"}
        return {"type": "object", "additionalProperties": number, "examples": [{"offset": 0.2}]}
