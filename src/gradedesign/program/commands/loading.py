"""Lines printed while Python loads the program, its libraries and plugins."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

#: Seconds between lines; a machine that is not busy has loaded everything before the first. Chosen,
#: not measured.
EVERY = 4.0


@contextmanager
def loading_lines(*, err: bool) -> Iterator[Callable[[], None]]:
    """Print a line every few seconds until the function that is yielded is called.

    ``err``: write to standard error: standard output holds the answer.
    """
    over = threading.Event()

    def tell() -> None:
        seconds = EVERY
        while not over.wait(EVERY):
            stream = sys.stderr if err else sys.stdout
            print(f"start       loading the program and its plugins, {seconds:.0f} s", file=stream)
            stream.flush()
            seconds += EVERY

    thread = threading.Thread(target=tell, name="loading", daemon=True)

    def stop() -> None:
        over.set()
        thread.join()

    thread.start()
    try:
        yield stop
    finally:
        stop()
