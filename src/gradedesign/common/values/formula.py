"""Formulas in x, y, z and d, or other variables: a small parser, without any evaluation of code.

The grammar, from the weakest binding to the strongest; ``^`` binds to the right and before a sign,
so ``-x^2`` is ``-(x^2)``::

    sum    = product { ("+" | "-") product }
    product = signed { ("*" | "/") signed }
    signed = ("+" | "-") signed | power
    power  = atom [ "^" signed ]
    atom   = number | name | name "(" sum { "," sum } ")" | "(" sum ")"
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.common.values.suggest import instead, shown
from gradedesign.common.values.units import DIMENSIONS
from gradedesign.errors import CaseError

#: Characters, and brackets in brackets, that no sensible formula has: mistakes or attacks. The
#: depth is far below Python's own limit on recursion. Chosen, not measured.
LONGEST, DEEPEST = 1000, 40

#: Variables of a formula of the part, mm.
_VARIABLES = ("x", "y", "z", "d")
CONSTANTS = {"pi": math.pi}

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>[-+*/^(),]))",
    re.ASCII,
)


def _smoothstep(low: FloatArray, high: FloatArray, value: FloatArray) -> FloatArray:
    """0 up to ``low``, 1 from ``high`` on, 3 s^2 - 2 s^3 between."""
    share = np.clip((value - low) / (high - low), 0.0, 1.0)
    return np.asarray(share**2 * (3 - 2 * share))


def _clamp(value: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    return np.minimum(np.maximum(value, low), high)


#: Function, and least and most number of arguments.
FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int, int]] = {
    "min": (lambda *a: np.minimum.reduce(np.broadcast_arrays(*a)), 2, 8),
    "max": (lambda *a: np.maximum.reduce(np.broadcast_arrays(*a)), 2, 8),
    "abs": (np.abs, 1, 1),
    "sqrt": (np.sqrt, 1, 1),
    "exp": (np.exp, 1, 1),
    "log": (np.log, 1, 1),
    "sin": (np.sin, 1, 1),
    "cos": (np.cos, 1, 1),
    "clamp": (_clamp, 3, 3),
    "smoothstep": (_smoothstep, 3, 3),
}

_OPERATORS: Mapping[str, tuple[Callable[..., Any], int]] = {
    "+": (np.add, 2),
    "-": (np.subtract, 2),
    "*": (np.multiply, 2),
    "/": (np.divide, 2),
    "^": (np.power, 2),
    "negate": (np.negative, 1),
}

#: One step of a program: a number, the name of a variable, or an operation and its arity.
Step = float | str | tuple[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """A parsed formula."""

    text: str  #: As written.
    program: tuple[Step, ...]  #: Steps in postfix order.
    variables: frozenset[str]  #: Those that occur.


def parse_formula(text: str, *, variables: tuple[str, ...] = _VARIABLES) -> Formula:
    """Parse a formula.

    Raises `CaseError` with the place of what is wrong and what would be right.

    ``text``: numbers, ``+ - * / ^``, parentheses, ``pi``, and the functions min, max, abs, sqrt,
    exp, log, sin, cos, clamp(value, low, high) and smoothstep(low, high, value). ``variables``:
    names of its variables.

    Examples
    --------
    >>> formula = parse_formula("0.1 + 0.4 * x / 100")
    >>> float(evaluate_formula(formula, {"x": np.array(50.0)}))
    0.30000000000000004
    """
    if len(text) > LONGEST:
        raise CaseError(
            f"the formula has {len(text)} characters; expected at most {LONGEST}; a map that "
            f"complicated belongs into a voxel array"
        )
    parser = _Parser(tokens=_tokens(text), variables=variables)
    parser.sum(0)
    if parser.next_token()[0]:
        raise parser.wrong("an operator or the end")
    steps = tuple(parser.program)
    return Formula(
        text=text, program=steps, variables=frozenset(s for s in steps if isinstance(s, str))
    )


def evaluate_formula(formula: Formula, values: Mapping[str, FloatArray]) -> FloatArray:
    """Value of a formula.

    ``values``: each ``(...)``; at least every variable that occurs; shapes that broadcast. Returns
    ``(...)``: of the common shape of ``values``. Not finite where the formula is not defined, such
    as at a division by zero: the caller decides whether it needs the value there.
    """
    stack: list[Any] = []
    with np.errstate(all="ignore"):
        for step in formula.program:
            if isinstance(step, str):
                stack.append(np.asarray(values[step], dtype=np.float64))
            elif isinstance(step, tuple):
                name, count = step
                call = _OPERATORS[name][0] if name in _OPERATORS else FUNCTIONS[name][0]
                arguments = stack[-count:]
                del stack[-count:]
                stack.append(call(*arguments))
            else:
                stack.append(np.float64(step))
    shape = np.broadcast_shapes(*(np.shape(v) for v in values.values()))
    return np.array(np.broadcast_to(stack[0], shape), dtype=np.float64)


@dataclass(slots=True)
class _Parser:
    """Recursive descent over tokens; writes the postfix program as it goes."""

    tokens: list[tuple[str, int]]
    variables: tuple[str, ...]
    at: int = 0
    program: list[Step] = field(default_factory=list)

    def next_token(self) -> tuple[str, int]:
        return self.tokens[self.at]

    def take(self, *words: str) -> str:
        """Return the next token and advance if it is one of the words, else an empty text."""
        word = self.next_token()[0]
        if word not in words or not word:
            return ""
        self.at += 1
        return word

    def wrong(self, expected: str) -> CaseError:
        word, place = self.next_token()
        token = f"{shown(word)} at character {place + 1}" if word else "the end"
        hint = "; write a power as x^2" if word == "*" else ""
        if word in DIMENSIONS["length"].units:
            hint = "; its lengths are numbers in mm: leave the unit out"
        return CaseError(f"found {token} of the formula, expected {expected}{hint}")

    def sum(self, depth: int) -> None:
        if depth > DEEPEST:
            raise CaseError(
                f"the formula nests deeper than {DEEPEST} at character {self.next_token()[1] + 1}"
            )
        self.product(depth)
        while word := self.take("+", "-"):
            self.product(depth)
            self.program.append((word, 2))

    def product(self, depth: int) -> None:
        self.signed(depth)
        while word := self.take("*", "/"):
            self.signed(depth)
            self.program.append((word, 2))

    def signed(self, depth: int) -> None:
        negative = False
        while word := self.take("+", "-"):
            negative ^= word == "-"
        self.power(depth)
        if negative:
            self.program.append(("negate", 1))

    def power(self, depth: int) -> None:
        self.atom(depth)
        if self.take("^"):
            if depth > DEEPEST:
                raise CaseError(f"the formula nests deeper than {DEEPEST}")
            self.signed(depth + 1)
            self.program.append(("^", 2))

    def atom(self, depth: int) -> None:
        word, _ = self.next_token()
        if self.take("("):
            self.sum(depth + 1)
            self.close()
        elif word[:1].isdigit() or word[:1] == ".":
            self.at += 1
            self.number(word)
        elif word[:1].isalpha() or word[:1] == "_":
            self.at += 1
            self.named(word, depth)
        else:
            raise self.wrong("a number, a name or (")

    def number(self, word: str) -> None:
        value = float(word)
        if not math.isfinite(value):
            raise CaseError(f"found {shown(word)}, a number too large to compute with")
        self.program.append(value)

    def named(self, word: str, depth: int) -> None:
        if word in self.variables:
            self.program.append(word)
        elif word in CONSTANTS:
            self.program.append(CONSTANTS[word])
        elif word in FUNCTIONS:
            self.call(word, depth)
        else:
            names = (*self.variables, *CONSTANTS, *FUNCTIONS)
            raise CaseError(f"found the unknown name {shown(word)}; {instead(word, names)}")

    def call(self, word: str, depth: int) -> None:
        _, least, most = FUNCTIONS[word]
        if not self.take("("):
            raise self.wrong(f"( after {word}")
        count = 1
        self.sum(depth + 1)
        while self.take(","):
            self.sum(depth + 1)
            count += 1
        self.close()
        if not least <= count <= most:
            wanted = str(least) if least == most else f"{least} to {most}"
            raise CaseError(f"{word} takes {wanted} arguments, found {count}")
        self.program.append((word, count))

    def close(self) -> None:
        if not self.take(")"):
            raise self.wrong(")")


def _tokens(text: str) -> list[tuple[str, int]]:
    """Words and where they start; an empty one at the end."""
    tokens = []
    at = 0
    end = len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        if match is None:
            bad = text[at:].lstrip()[0]
            hint = "; it states a value: write x - 20, not x < 20" if bad in "<>=" else ""
            raise CaseError(
                f"found {shown(bad)} in the formula, expected numbers, names, + - * / ^ , ( ){hint}"
            )
        tokens.append((match[match.lastgroup or 0], match.start(match.lastgroup or 0)))
        at = match.end()
    tokens.append(("", end))
    return tokens
