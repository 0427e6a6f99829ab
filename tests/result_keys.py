"""Keys of result.json: those that docs/result.md documents, and those that a result has."""

import re
from itertools import product
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "result.md"


def documented():
    """Paths such as ``limits[].band.low``; ``{a, b}`` of the page written out."""
    rows = [line.split("|")[1] for line in PAGE.read_text().splitlines() if line.startswith("| `")]
    keys = [key for row in rows for key in re.findall(r"`([^`]+)`", row)]
    return [path for key in keys for path in _expanded(key)]


def _expanded(key):
    parts = re.split(r"\{([^}]*)\}", key)
    choices = [part.split(", ") if n % 2 else [part] for n, part in enumerate(parts)]
    return ["".join(chosen) for chosen in product(*choices)]


def written(value, path=""):
    """Paths of plain data down to its leaves; empty tables and lists are leaves."""
    if isinstance(value, dict) and value:
        for name, entry in value.items():
            yield from written(entry, f"{path}.{name}" if path else name)
    elif isinstance(value, list | tuple) and any(isinstance(entry, dict) for entry in value):
        for entry in value:
            yield from written(entry, f"{path}[]")
    else:
        yield path


def undocumented(result):
    """Keys of a result that the page does not have; an empty or null one may stand for more."""
    patterns = [_pattern(path) for path in documented()]
    found = dict.fromkeys(written(result))
    return [path for path in found if not any(_fits(pattern, path) for pattern in patterns)]


def _pattern(path):
    """Expressions of a path's steps, innermost last; a name of the case may hold dots."""
    steps = re.findall(r"<[^>]*>|\[\]|\.\*|[^.\[<]+", path)
    return [
        r"\.?.+" if step.startswith("<") else r"(\..*|\[\].*)?" if step == ".*" else
        r"(\[\])" if step == "[]" else r"\.?" + re.escape(step)
        for step in steps
    ]  # fmt: skip


def _fits(pattern, path):
    """Whether a path is a documented one, or an empty place above it; a bare name is no place."""
    ends = [n for n, step in enumerate(pattern, 1) if n == len(pattern) or not step.endswith(".+")]
    return any(re.fullmatch("".join(pattern[:end]), path) for end in ends)
