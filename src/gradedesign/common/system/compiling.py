"""Whether numba compiles a kernel at this moment: up to a minute in the first run on a machine."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from gradedesign.common.system.progress import Step

#: Numba keeps what it compiled beside the sources, or in the user's cache: all kernels ask for it.
WORDS = "compiling, once on this machine"


@dataclass(slots=True)
class _Compilations:
    """Listener to numba, which tells of what it compiles and not of what its cache holds.

    One that was under way when the listener came is known by its end alone.
    """

    listening: bool = False
    depth: int = 0
    began: float = 0.0
    first: Callable[[], None] | None = None
    called: bool = False

    def notify(self, event: Any) -> None:
        """Count compilations under way: those of called kernels lie in that of their caller."""
        if event.is_start and self.depth == 0:
            self.began = time.monotonic()
            if self.first is not None and not self.called:
                self.called = True
                self.first()
        self.depth = max(self.depth + (1 if event.is_start else -1), 0)

    def listen(self) -> None:
        """Register with numba, once something has imported it."""
        # Numba has this name once the module of its events is whole.
        if not self.listening and hasattr(sys.modules.get("numba"), "njit"):
            events: Any = sys.modules["numba.core.event"]
            events.Listener.register(_Compilations)
            events.register("numba:compile", self)
            self.listening = True


_COMPILATIONS = _Compilations()


def compiling() -> Step | None:
    """The compilation that is under way, as a step; None where none is.

    To be called now and then from the beginning on: it listens once something has imported numba,
    which it does not import itself.
    """
    _COMPILATIONS.listen()
    if _COMPILATIONS.depth == 0:
        return None
    return Step(text=WORDS, fraction=None, began=_COMPILATIONS.began)


@contextmanager
def when_compiling(first: Callable[[], None]) -> Iterator[None]:
    """Call a function when the first compilation within the block begins, once in a process."""
    _COMPILATIONS.listen()
    _COMPILATIONS.first = first
    try:
        yield
    finally:
        _COMPILATIONS.first = None
