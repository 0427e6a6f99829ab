"""End a command on Ctrl-C or SIGTERM, even where code swallows exceptions."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from gradedesign.errors import Interrupted

#: Seconds after which a request to end that was swallowed is made again. Chosen, not measured.
_AGAIN_S = 0.3

_END_SIGNALS = (signal.SIGINT, signal.SIGTERM)
#: Windows has no such timer: there a swallowed request has to be made again by hand.
_HAS_TIMER = hasattr(signal, "setitimer")


class Interruption:
    """Record of a request to end the command.

    An exception that a signal handler raises inside a callback of C code or a finaliser, for
    example while kernels compile, is lost or turned into another exception. So it is raised again
    until it arrives. Once it propagates nothing more is raised, so that clean-up can finish.
    """

    def __init__(self) -> None:
        self.stop_requested = False

    def ask(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal that asks to end, or the timer that repeats it."""
        del number, frame
        if not self.stop_requested:
            self.stop_requested = True
            _repeat(_AGAIN_S, _AGAIN_S)
        if not _on_its_way(sys.exception()):
            raise Interrupted


def _repeat(first: float, interval: float) -> None:
    """Set the timer that repeats a request, where there is one; 0 s stops it."""
    if _HAS_TIMER:
        signal.setitimer(signal.ITIMER_REAL, first, interval)


def _on_its_way(error: BaseException | None) -> bool:
    """Whether the exception being handled is an interruption or was caused by one."""
    while error is not None:
        if isinstance(error, Interrupted):
            return True
        error = error.__context__
    return False


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """Turn SIGINT and SIGTERM into `Interrupted` until the end of a ``with`` statement."""
    interruption = Interruption()
    report_lost = sys.unraisablehook

    def report(lost: sys.UnraisableHookArgs) -> None:
        # A request that is lost is raised again, and after one finalisers of objects that it left
        # half built fail: nobody needs to hear of either.
        if not interruption.stop_requested:
            report_lost(lost)

    alarm = signal.getitimer(signal.ITIMER_REAL) if _HAS_TIMER else (0.0, 0.0)
    numbers = (*_END_SIGNALS, signal.SIGALRM) if _HAS_TIMER else _END_SIGNALS
    before = {n: signal.signal(n, interruption.ask) for n in numbers}
    sys.unraisablehook = report
    try:
        yield interruption
    finally:
        for number in before:
            signal.signal(number, signal.SIG_IGN)
        _repeat(0.0, 0.0)
        # What a request left half built may be freed as late as at the end of the process.
        if not interruption.stop_requested:
            sys.unraisablehook = report_lost
        for number, handler in before.items():
            # None is a handler of C code, which cannot be put back from here.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        _repeat(*alarm)
