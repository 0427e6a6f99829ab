"""Bodies of a part's file that are no solids of the part, such as modifiers and supports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

#: Names in one text; result.json and the report have all. Chosen, not measured.
_MOST_NAMES = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class FileBody:
    """A body that is subtracted from the part or left out of it.

    Attributes
    ----------
    name : str
        Of the body or its object in the file.
    role : str
        Such as ``negative volume``, ``parameter modifier``, ``not printable``.
    """

    name: str
    role: str
    #: Role of a body that takes material away from those before it.
    NEGATIVE: ClassVar[str] = "negative volume"

    @property
    def done(self) -> str:
        """``subtracted`` or ``left out``."""
        return "subtracted" if self.role == self.NEGATIVE else "left out"

    def __str__(self) -> str:
        return f"'{self.name}' ({self.role})"


def file_body_words(bodies: Sequence[FileBody]) -> list[str]:
    """One text for the bodies that are subtracted, one for those that are left out."""
    words = []
    for done in ("subtracted", "left out"):
        found = [str(body) for body in bodies if body.done == done]
        if found:
            more = len(found) - _MOST_NAMES
            listed = ", ".join(found[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
            words.append(f"bodies {done}: {listed}")
    return words


def file_body_data(bodies: Sequence[FileBody]) -> tuple[dict[str, str], ...]:
    """Plain data of result.json and ``check --json``."""
    return tuple({"name": body.name, "role": body.role, "done": body.done} for body in bodies)
