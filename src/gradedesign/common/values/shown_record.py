"""Records that a notebook draws, that stay on one screen as text, and that become tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from reprlib import Repr
from typing import Any

from gradedesign.errors import CaseError


class ShownRecord:
    """Base of records that a notebook shows as a picture or scene, and a console in a few lines."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """HTML for a notebook; None where it shows the text."""
        return _DRAWING[-1](self)

    def __repr__(self) -> str:
        """Fields, long ones shortened: arrays by their shapes."""
        # Of dataclasses, and of pydantic's models.
        names = getattr(self, "__dataclass_fields__", None) or type(self).model_fields  # type: ignore[attr-defined]
        fields = [f"{name}={_SHORT.repr(getattr(self, name))}" for name in names]
        lines = "\n  ".join(["", *fields])
        return f"<{type(self).__name__}{lines}>"


def drawn_by(draw: Callable[[object], str | None]) -> None:
    """State how a record is drawn: drawing belongs to the program, which knows all records."""
    _DRAWING.append(draw)


def frame_of(rows: Sequence[Mapping[str, Any]]) -> Any:
    """A pandas ``DataFrame`` of rows.

    Raises `CaseError` if pandas is not installed.
    """
    try:
        # Not by an import statement: it is optional, and type checks must pass without it too.
        pandas = import_module("pandas")
    except ImportError:
        raise CaseError(
            "to_frame() makes a table of pandas, which is not installed: "
            "pip install 'gradedesign[notebook]', or pip install pandas"
        ) from None
    return pandas.DataFrame(list(rows))


class _Short(Repr):
    """Values in a line."""

    def __init__(self) -> None:
        super().__init__()
        # Half a line of a terminal. Chosen.
        self.maxstring = self.maxother = 60
        self.maxlevel = 2

    def repr_ndarray(self, array: Any, _: int) -> str:
        """An array by its shape."""
        return f"<array {array.shape} {array.dtype}>"

    def repr_instance(self, x: Any, level: int) -> str:
        """A record of these by its name, and no record's lines."""
        if isinstance(x, ShownRecord):
            return f"<{type(x).__name__}>"
        return " ".join(super().repr_instance(x, level).split())


_SHORT = _Short()
_DRAWING: list[Callable[[object], str | None]] = [lambda record: None]  # noqa: ARG005
