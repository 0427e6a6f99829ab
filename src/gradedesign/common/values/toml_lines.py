"""Line numbers of the keys of a TOML text, found by one linear pass before it is parsed.

``tomllib`` tells no lines, and takes quadratic time for a key of very many parts; this scan finds
the lines and refuses such keys, deep nesting and masses of entries before ``tomllib`` sees them.
It reads any valid TOML; where the text is not valid it stops and leaves the message to ``tomllib``.
"""

from __future__ import annotations

import bisect
import contextlib
import re
import tomllib
from typing import TypeAlias

from gradedesign.errors import CaseError

Key: TypeAlias = tuple[str | int, ...]

#: Parts of a key, far more than the schema nests: bounds the work on damaged files. Chosen, not
#: measured.
_DEEPEST = 24
#: Keys and list entries, far more than a case needs: bounds the work on damaged files. Chosen, not
#: measured.
_MOST_ENTRIES = 5000
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_BASIC = re.compile(r'"(?:[^"\\\n]|\\.)*"')
_LITERAL = re.compile(r"'[^'\n]*'")
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"""(?:"{0,2})'
    r"|'''.*?'''(?:'{0,2})"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]+")


class _NotToml(Exception):  # noqa: N818  control flow of this file, never seen outside
    """The text is not valid TOML from here on."""


def key_lines(text: str) -> dict[Key, int]:
    r"""Line number of every key of a TOML text.

    Raises `CaseError` if a key is nested deeper than 24 levels or there are more than 5000 entries.

    Parameters
    ----------
    text : str
        TOML with ``\n`` line ends; need not be valid.

    Returns
    -------
    dict of tuple to int
        Path such as ``("load_case", 0, "load", 1, "force")`` to its line, counted from 1. Up to
        the first syntax error where there is one.

    Examples
    --------
    >>> key_lines('[a]\nb = 1\n[[c]]\nd = {e = 2}')[("c", 0, "d", "e")]
    4
    """
    scanner = _Scanner(text)
    with contextlib.suppress(_NotToml):
        scanner.scan()
    return scanner.lines


def line_of(lines: dict[Key, int], key: Key) -> int:
    """Line of a key, or of the nearest table around it that is written; 1 when there is none."""
    for length in range(len(key), 0, -1):
        line = lines.get(key[:length])
        if line is not None:
            return line
    return 1


class _Scanner:
    """State of the single pass: position, current table and what was found."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        self.lines: dict[Key, int] = {}
        self._tables: dict[Key, int] = {}  # array of tables -> index of its last entry
        self._line_starts = [m.end() for m in re.finditer("\n", text)]
        self._entries = 0

    def scan(self) -> None:
        table: Key = ()
        while True:
            self._skip(_BLANK)
            if self.position >= len(self.text):
                return
            if self.text[self.position] == "[":
                table = self._header()
            else:
                self._pair(table)

    def _header(self) -> Key:
        start = self.position
        many = self.text.startswith("[[", start)
        self.position += 2 if many else 1
        parts = self._key_parts()
        self._take("]]" if many else "]")
        key: Key = ()
        for i, part in enumerate(parts):
            key = (*key, part)
            if many and i == len(parts) - 1:
                self._tables[key] = self._tables.get(key, -1) + 1
            self._record(key, start)
            if key in self._tables:
                key = (*key, self._tables[key])
        self._record(key, start)
        return key

    def _pair(self, table: Key) -> None:
        start = self.position
        key = table
        for part in self._key_parts():
            key = (*key, part)
            self._record(key, start)
        self._take("=")
        self._skip(_SPACE)
        self._value(key)

    def _value(self, key: Key) -> None:
        character = self.text[self.position : self.position + 1]
        if character == "[":
            self._array(key)
        elif character == "{":
            self._inline_table(key)
        elif character in ('"', "'") and character:
            self._match(_STRING)
        else:
            self._match(_SCALAR)

    def _array(self, key: Key) -> None:
        self.position += 1
        index = 0
        self._skip(_BLANK)
        while not self._taken("]"):
            self._record((*key, index), self.position)
            self._value((*key, index))
            index += 1
            self._skip(_BLANK)
            if not self._taken(","):
                self._take("]")
                return
            self._skip(_BLANK)

    def _inline_table(self, key: Key) -> None:
        self.position += 1
        self._skip(_BLANK)
        while not self._taken("}"):
            self._pair(key)
            self._skip(_BLANK)
            if not self._taken(","):
                self._take("}")
                return
            self._skip(_BLANK)

    def _key_parts(self) -> list[str]:
        parts: list[str] = []
        while True:
            self._skip(_SPACE)
            parts.append(self._key_part())
            if len(parts) > _DEEPEST:
                raise CaseError(
                    f"line {self._line(self.position)}: a key of more than {_DEEPEST} parts; a "
                    "case needs at most 6"
                )
            self._skip(_SPACE)
            if not self._taken("."):
                return parts

    def _key_part(self) -> str:
        character = self.text[self.position : self.position + 1]
        if character == '"':
            raw = self._match(_BASIC)
            try:
                return str(tomllib.loads(f"k = {raw}")["k"])
            except ValueError:
                raise _NotToml from None
        if character == "'":
            return self._match(_LITERAL)[1:-1]
        return self._match(_BARE_KEY)

    def _record(self, key: Key, position: int) -> None:
        if len(key) > _DEEPEST:
            raise CaseError(
                f"line {self._line(position)}: nested deeper than {_DEEPEST} levels; a case "
                "needs at most 6"
            )
        if key in self.lines:
            return
        self._entries += 1
        if self._entries > _MOST_ENTRIES:
            raise CaseError(
                f"line {self._line(position)}: more than {_MOST_ENTRIES} entries; a case needs "
                "a few hundred at most"
            )
        self.lines[key] = self._line(position)

    def _line(self, position: int) -> int:
        return bisect.bisect_right(self._line_starts, position) + 1

    def _skip(self, pattern: re.Pattern[str]) -> None:
        match = pattern.match(self.text, self.position)
        if match is not None:
            self.position = match.end()

    def _match(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self.text, self.position)
        if match is None:
            raise _NotToml
        self.position = match.end()
        return match.group()

    def _taken(self, mark: str) -> bool:
        if self.text.startswith(mark, self.position):
            self.position += len(mark)
            return True
        return False

    def _take(self, mark: str) -> None:
        if not self._taken(mark):
            raise _NotToml
