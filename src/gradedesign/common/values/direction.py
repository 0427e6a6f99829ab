"""Directions along the axes of a part."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from gradedesign.common.values.suggest import listed, shown
from gradedesign.common.values.value_types import Choice, JsonSchema, Refused

_SIGNED = ("+x", "-x", "+y", "-y", "+z", "-z")
_AXES = ("x", "y", "z")
#: Axes of the machine, x, y and the build direction, in those of the part; each is a rotation.
FRAMES = {
    "+z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "+x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    "+y": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
}
#: Words for the directions of a part that stands upright.
_UPRIGHT = {"up": "+z", "top": "+z", "upwards": "+z", "down": "-z", "bottom": "-z"}


def _signed(value: object) -> object:
    """A direction in small letters.

    Raises `Refused` for one as a word, whose axis only the user knows.
    """
    text = value.lower() if isinstance(value, str) else ""
    if text in _UPRIGHT:
        raise Refused(
            f'found {shown(value)}; did you mean "{_UPRIGHT[text]}"? available: {listed(_SIGNED)}'
        )
    return text if text in _SIGNED else value


class _Along(Choice):
    """A direction; a letter alone means the positive one."""

    __slots__ = ()

    def read(self, value: object) -> str:
        letter = value.lower() if isinstance(value, str) else ""
        return f"+{letter}" if letter in _AXES else super().read(_signed(value))

    def json_schema(self) -> JsonSchema:
        return {"enum": [*self.words, *_AXES]}


class _Facing(Choice):
    """A direction that faces have, of which both signs are as likely."""

    __slots__ = ()

    def read(self, value: object) -> str:
        if value in _AXES:
            raise Refused(
                f'found {shown(value)}; did you mean "+{value}" or "-{value}"? available: '
                f"{listed(self.words)}"
            )
        return super().read(_signed(value))


Direction: TypeAlias = Annotated[str, _Along(_SIGNED)]
Facing: TypeAlias = Annotated[str, _Facing(_SIGNED)]
