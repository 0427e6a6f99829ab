"""Progress reports of a run; only the command line draws them.

Two ways lead out of a computation. An `Event` goes to the listener that the caller passed: a stage
began or ended, an iteration was finished. A *step* says where a long computation stands at this
moment: `report_step`, `stepping` and `counted` write it into the `Watch` of the current context,
where another thread may read it, and do nothing where nobody watches. So steps need no argument
through ten functions, and cost nothing that could be measured.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One step of a run."""

    #: Lower case with dashes: ``law``, ``walls``, ``solid``, ``sizing``, ``lattice``, ``explicit``,
    #: ``acceptance``.
    stage: str
    message: str  #: One line for a person.
    seconds: float | None = None  #: Seconds of the step; None while it runs.
    #: Numbers behind the message; each name ends in its unit (``mass_g``) or is a ratio.
    values: Mapping[str, float] = field(default_factory=dict)
    fraction: float | None = None  #: Share of the step that is done, 0 to 1, where it is known.

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))


#: Receives every event of a run, in the thread of the run; what it raises ends the run.
Listener: TypeAlias = Callable[[Event], None]


def ignore(event: Event) -> None:
    """Listen to nothing: the default of ``run(..., on_event=...)``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """Step of a computation with its progress."""

    text: str  #: Name of the step, for a person; empty at the beginning of a level.
    fraction: float | None  #: Share of it that is done, 0 to 1, where it is known.
    began: float  #: s. By `time.monotonic`.


class Watch:
    """The steps that a computation is in, outermost first; any thread may read them.

    Parameters
    ----------
    clock : callable
        Seconds.
    before_blocking : callable, optional
        Called in the thread of the computation before a step in which no other thread runs.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        *,
        before_blocking: Callable[[], None] | None = None,
    ) -> None:
        self._clock = clock
        self._before_blocking = before_blocking
        self._lock = threading.Lock()
        self._levels: list[Step] = [Step(text="", fraction=None, began=clock())]

    def steps(self) -> tuple[Step, ...]:
        """Return the steps that are under way, outermost first."""
        with self._lock:
            return tuple(step for step in self._levels if step.text)

    def report(self, text: str, fraction: float | None = None) -> None:
        """Replace the innermost step; it keeps its time of beginning while its text stays."""
        with self._lock:
            last = self._levels[-1]
            began = last.began if last.text == text else self._clock()
            self._levels[-1] = Step(text=text, fraction=fraction, began=began)

    def block(self) -> None:
        """Report that no other thread will run for a while."""
        if self._before_blocking is not None:
            self._before_blocking()

    def enter(self) -> int:
        """Open a level below the innermost step; return what `leave` wants."""
        with self._lock:
            self._levels.append(Step(text="", fraction=None, began=self._clock()))
            return len(self._levels) - 1

    def leave(self, depth: int) -> None:
        """Close a level, with those that an exception left open below it, and end its step."""
        with self._lock:
            del self._levels[depth:]
            self._levels[-1] = Step(text="", fraction=None, began=self._clock())


#: Who watches the computation of this context; no listener, no work.
_WATCH: ContextVar[Watch | None] = ContextVar("gradedesign_watch", default=None)


@contextmanager
def watching(watch: Watch) -> Iterator[None]:
    """Let steps that are reported in this context reach a watch."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


def report_step(text: str, fraction: float | None = None, *, blocking: bool = False) -> None:
    """Report the step that is computed from here on.

    Parameters
    ----------
    text : str
        For a person, without its numbers of progress: ``"multigrid iterations"``.
    fraction : float, optional
        Share that is done, 0 to 1.
    blocking : bool
        What follows holds the interpreter's lock, so that it must be said now or after it.

    Examples
    --------
    >>> report_step("reading slices", 0.5)  # shown by whoever watches: `run`, or nobody
    """
    watch = _WATCH.get()
    if watch is not None:
        watch.report(text, fraction)
        if blocking:
            watch.block()


@contextmanager
def stepping(text: str, fraction: float | None = None) -> Iterator[None]:
    """Say what is being computed in the block; steps reported inside stand below it."""
    watch = _WATCH.get()
    if watch is None:
        yield
        return
    watch.report(text, fraction)
    depth = watch.enter()
    try:
        yield
    finally:
        watch.leave(depth)


def counted(items: Iterable[T], text: str, count: int) -> Iterator[T]:
    """Hand on items, reporting ``text k of count`` before each.

    Examples
    --------
    >>> [n for n in counted(iter("ab"), "window", 2)]
    ['a', 'b']
    """
    for number, item in enumerate(items):
        with stepping(f"{text} {number + 1} of {count}", number / count if count else None):
            yield item
