"""Words for messages: what was found, what is allowed, and the nearest spelling."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterable, Mapping

#: Names in one message, some three lines. Chosen, not measured.
_MOST_WORDS = 24
#: A wrong value is recognised by its beginning; a message stays on one line. Chosen, not measured.
_MOST_CHARACTERS = 60
#: Words that a question offers, letters from which a beginning tells anything, and characters of a
#: text that are compared. Chosen, not measured.
_MOST_MEANT, _LEAST_LETTERS, _READ = 4, 3, 400


def shown(value: object) -> str:
    """Describe a value of a case file in a few printable words.

    ``value``: anything that TOML can hold. Returns str: at most about 70 characters, without line
    breaks or control characters.

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


def listed(words: Iterable[str], most: int = _MOST_WORDS) -> str:
    """Join words by commas, the first two dozen, or ``most``, of them."""
    every = list(words)
    text = ", ".join(every[:most])
    if len(every) > most:
        text += f" and {len(every) - most} more"
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


def meant(word: str, choices: Iterable[str]) -> tuple[str, ...]:
    """Choices that a wrong word may stand for, the likeliest ones; empty where none is close.

    Those spelled as it is but for blanks, dashes and case; those that begin with it, of which the
    shortest are enough; those that are a word of it; else the nearest.

    Examples
    --------
    >>> meant("gyroid", ["bcc", "gyroid-sheet", "gyroid-wall", "gyroid-wall-opposite"])
    ('gyroid-sheet', 'gyroid-wall')
    >>> meant("316L stainless", ["316L", "PA12"])
    ('316L',)
    """
    every, plain = list(choices), _plain(word)
    if same := tuple(choice for choice in every if _plain(choice) == plain):
        return same
    if len(plain) >= _LEAST_LETTERS:
        longer = [choice for choice in every if _plain(choice).startswith(plain)]
        shortest = [c for c in longer if not any(_begins(c, other) for other in longer)]
        if shortest:
            return tuple(shortest[:_MOST_MEANT])
    words = f"-{plain}-"
    if held := tuple(choice for choice in every if choice and f"-{_plain(choice)}-" in words):
        return held[:_MOST_MEANT]
    guess = nearest(word, every)
    return () if guess is None else (guess,)


def described(word: str, descriptions: Mapping[str, str]) -> tuple[str, ...]:
    """Names that a word describes: each part of it begins a word of the name or of its description.

    Parts of one or two letters are looked for in the name alone, numbers anywhere in it.

    Examples
    --------
    >>> described("schwarz-p", {"primitive-sheet": "the Schwarz primitive", "bcc": "struts"})
    ('primitive-sheet',)
    """
    parts = [part for part in _plain(word).split("-") if part]
    if not any(len(part) > _LEAST_LETTERS for part in parts):
        return ()
    fitting = [
        name
        for name, text in descriptions.items()
        if all(
            f"-{part}" in f"-{_plain(name)}"
            or (part.isdigit() and part in name)
            or (len(part) >= _LEAST_LETTERS and f"-{part}" in f"-{_plain(text)}")
            for part in parts
        )
    ]
    shortest = [name for name in fitting if not any(_begins(name, other) for other in fitting)]
    return tuple(sorted(shortest, key=lambda name: (len(name), name))[:_MOST_MEANT])


def question(words: Iterable[str]) -> str:
    """``did you mean "a", "b" or "c"?``, or nothing without any."""
    quoted = [f'"{word}"' for word in words]
    if len(quoted) < 2:
        return f"did you mean {quoted[0]}?" if quoted else ""
    return f"did you mean {', '.join(quoted[:-1])} or {quoted[-1]}?"


def instead(word: str, choices: Iterable[str], *, label: str = "available") -> str:
    """Say what to write instead of a wrong word.

    Returns str: ``did you mean "a"? available: a, b, c``, the question only when a choice is close.
    """
    every = list(choices)
    if not every:
        return f"{label}: none"
    return f"{question(meant(word, every))} {label}: {listed(every)}".lstrip()


def _plain(text: str) -> str:
    """Lower-case words joined by dashes."""
    return re.sub(r"[^a-z0-9.+]+", "-", text[:_READ].lower()).strip("-")


def _begins(longer: str, other: str) -> bool:
    """Whether a name is another one with more words."""
    return _plain(longer).startswith(f"{_plain(other)}-")
