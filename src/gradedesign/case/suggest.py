"""Words for messages: what was found, what is allowed, and the nearest spelling."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable

_MOST_WORDS = 24
_MOST_CHARACTERS = 60


def shown(value: object) -> str:
    """Describe a value of a case file in a few printable words.

    Parameters
    ----------
    value : object
        Anything that TOML can hold.

    Returns
    -------
    str
        At most about 70 characters, without line breaks or control characters.

    Examples
    --------
    >>> shown("5 mm"), shown([1, 2]), shown(True)
    ('"5 mm"', 'a list of 2', 'true')
    """
    if isinstance(value, str):
        cut = value if len(value) <= _MOST_CHARACTERS else value[: _MOST_CHARACTERS - 3] + "..."
        if not cut.isprintable():
            return json.dumps(cut)
        return f'"{cut}"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        # str() of a whole number with thousands of digits raises
        return str(value) if abs(value) < 10**18 else "a whole number beyond 1e18"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "a table"
    return f"a {type(value).__name__}"


def listed(words: Iterable[str]) -> str:
    """Join words by commas, the first two dozen of them."""
    every = list(words)
    text = ", ".join(every[:_MOST_WORDS])
    if len(every) > _MOST_WORDS:
        text += f" and {len(every) - _MOST_WORDS} more"
    return text


def nearest(word: str, choices: Iterable[str]) -> str | None:
    """Return the choice spelled most like a word, or None when none is close.

    Upper and lower case count as equal.

    Examples
    --------
    >>> nearest("magnitud", ["region", "magnitude"])
    'magnitude'
    """
    by_lower: dict[str, str] = {}
    for choice in choices:
        by_lower.setdefault(choice.lower(), choice)
    matches = difflib.get_close_matches(word[:200].lower(), by_lower, n=1, cutoff=0.6)
    return by_lower[matches[0]] if matches else None


def instead(word: str, choices: Iterable[str], *, label: str = "available") -> str:
    """Say what to write instead of a wrong word.

    Returns
    -------
    str
        ``did you mean "a"? available: a, b, c``, the question only when a choice is close.
    """
    every = list(choices)
    if not every:
        return f"{label}: none"
    guess = nearest(word, every)
    question = f'did you mean "{guess}"? ' if guess is not None else ""
    return f"{question}{label}: {listed(every)}"
