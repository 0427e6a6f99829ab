"""Most memory that a computation holds."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from gradedesign.commands import resident_memory_bytes

#: Seconds between looks at the memory. Chosen: a look takes milliseconds.
_LOOK_S = 0.5


@contextmanager
def peak_memory() -> Iterator[Callable[[], int]]:
    """Watch the resident memory of this process and of those it starts; yields what tells the most.

    A look every half a second: shorter peaks are missed.
    """
    stop, peak = threading.Event(), resident_memory_bytes()

    def look() -> None:
        nonlocal peak
        while not stop.wait(_LOOK_S):
            peak = max(peak, resident_memory_bytes())

    thread = threading.Thread(target=look, name="memory", daemon=True)
    thread.start()
    try:
        yield lambda: max(peak, resident_memory_bytes())
    finally:
        stop.set()
        thread.join()
