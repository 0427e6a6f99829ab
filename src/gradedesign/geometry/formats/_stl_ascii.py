"""The ASCII form of STL: a fast path for well-formed files, a careful one that finds the fault."""

from __future__ import annotations

import re

import numpy as np

from gradedesign.arrays import FloatArray
from gradedesign.errors import PartError

_SOLID_LINE = re.compile(rb"^[ \t]*(end)?solid(?:[ \t][^\n]*)?$", re.MULTILINE)

_FACET = b"facet normal # # # outer loop vertex # # # vertex # # # vertex # # # endloop endfacet"
_PATTERN = _FACET.split()
#: Where the nine coordinates sit among the 21 words of a facet.
_COORDINATES = tuple(k for k, word in enumerate(_PATTERN) if word == b"#" and k > 4)


def parse_ascii(data: bytes, source: str) -> FloatArray:
    """Decode ASCII STL into corners ``(m, 3, 3)`` in file units.

    Tabs, any line ends, upper case, exponents and several solids are fine. Raises `PartError`:
    names the line that is not STL, or says that an ``endsolid`` is missing.
    """
    text = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").lower()
    corners = _parse_fast(text)
    if corners is None:
        corners = _parse_lines(text, source)
    ends = [match[1] is not None for match in _SOLID_LINE.finditer(text)]
    if ends.count(True) < ends.count(False):
        raise PartError(
            f"{source}: 'endsolid' is missing after {len(corners)} facets, so the file may be cut "
            "between two shells; export it again, or add a last line 'endsolid' if it is whole"
        )
    return corners


def _parse_fast(text: bytes) -> FloatArray | None:
    """Decode by slicing whole columns of words; None if anything is out of place."""
    if b"_" in _SOLID_LINE.sub(b"", text):  # float() would take 1_000
        return None
    pieces = _SOLID_LINE.split(text)[::2]  # every other piece is the captured "end"
    if pieces[0].strip():
        return None
    blocks = [_block(piece.split()) for piece in pieces[1:]]
    good = [block for block in blocks if block is not None]
    if len(good) != len(blocks) or not good:
        return None
    return np.concatenate(good).reshape(-1, 3, 3)


def _block(words: list[bytes]) -> FloatArray | None:
    """Decode the words between two solid lines into ``(k, 9)``; None if out of place."""
    size = len(_PATTERN)
    if len(words) % size:
        return None
    for k, keyword in enumerate(_PATTERN):
        if keyword != b"#" and words[k::size].count(keyword) != len(words) // size:
            return None
    try:
        columns = [list(map(float, words[k::size])) for k in _COORDINATES]
    except ValueError:
        return None
    return np.array(columns, dtype=np.float64).T


def _parse_lines(text: bytes, source: str) -> FloatArray:
    """Decode word by word, so that an error can name its line."""
    values: list[float] = []
    place = 0  # position in the pattern of a facet
    inside = False
    line = 0
    for line, content in enumerate(text.split(b"\n"), start=1):
        match = _SOLID_LINE.fullmatch(content)
        if match and place == 0:
            inside = match[1] is None
            continue
        for word in content.split():
            if not inside:
                raise _fault(source, line, word, "'solid'")
            expected = _PATTERN[place]
            if expected != b"#" and word != expected:
                raise _fault(source, line, word, f"'{expected.decode()}'")
            if place in _COORDINATES:
                values.append(_number(word, source, line))
            place = (place + 1) % len(_PATTERN)
    if place:
        missing = _PATTERN[place].decode().replace("#", "a number")
        raise PartError(
            f"{source}, line {line}: the file ends inside a facet, before '{missing}'; "
            "it is truncated, export it again"
        )
    return np.array(values, dtype=np.float64).reshape(-1, 3, 3)


def _number(word: bytes, source: str, line: int) -> float:
    """Decode one coordinate."""
    if b"," in word:
        raise PartError(
            f"{source}, line {line}: decimal comma in {_shown(word)}; "
            "STL needs decimal points, export with an English number format"
        )
    try:
        return float(word.replace(b"_", b"?"))
    except ValueError as error:
        raise _fault(source, line, word, "a number") from error


def _fault(source: str, line: int, word: bytes, expected: str) -> PartError:
    return PartError(f"{source}, line {line}: found {_shown(word)}, expected {expected}")


def _shown(word: bytes) -> str:
    """Quote a word of the file safely and briefly."""
    return repr(word[:40].decode("latin-1"))
