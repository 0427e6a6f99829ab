"""Directions along the axes of a part."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from gradedesign.case.suggest import listed, shown
from gradedesign.case.value_types import Choice, JsonSchema, Refused

_SIGNED = ("+x", "-x", "+y", "-y", "+z", "-z")
_AXES = ("x", "y", "z")


class _Along(Choice):
    """A direction; a letter alone means the positive one."""

    __slots__ = ()

    def read(self, value: object) -> str:
        return f"+{value}" if value in _AXES else super().read(value)

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
        return super().read(value)


Direction: TypeAlias = Annotated[str, _Along(_SIGNED)]
Facing: TypeAlias = Annotated[str, _Facing(_SIGNED)]
