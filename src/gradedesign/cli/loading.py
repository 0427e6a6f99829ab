"""A sign of life while Python loads the program, its libraries and plugins."""

from __future__ import annotations

import sys
import threading
from types import TracebackType
from typing import Self

#: Seconds between lines; a machine that is not busy has loaded everything before the first.
EVERY = 4.0


class Loading:
    """Prints a line every few seconds until it is stopped; stopped at the end of its context.

    Parameters
    ----------
    err : bool
        Write to standard error: standard output holds the answer.
    """

    def __init__(self, *, err: bool) -> None:
        self._err = err
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tell, name="loading", daemon=True)

    def __enter__(self) -> Self:
        """Start counting."""
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Print no more lines."""
        self.stop()

    def stop(self) -> None:
        """Print no more lines."""
        self._over.set()
        self._thread.join()

    def _tell(self) -> None:
        seconds = EVERY
        while not self._over.wait(EVERY):
            stream = sys.stderr if self._err else sys.stdout
            print(f"start       loading the program and its plugins, {seconds:.0f} s", file=stream)
            stream.flush()
            seconds += EVERY
