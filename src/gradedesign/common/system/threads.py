"""Independent pieces of work in threads: calls of a function, or ranges of a compiled kernel.

Kernels are threaded from here and not by numba, which compiles the body of a parallel loop four
times: 83 of the 166 s that the first run of `cases/mini` on a machine compiled. Handing a range to
a waiting thread takes 15 microseconds, numba's parallel loop 8.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from typing import Any, TypeVar

from numba import config, get_num_threads

#: Items for every thread that are begun before the first result is taken. Chosen, not measured.
AHEAD = 2

T = TypeVar("T")
S = TypeVar("S")


def in_threads(work: Callable[[T], S], items: Iterable[T]) -> Iterator[S]:
    """Results of a function of each item, in the order of the items.

    The function runs in as many threads as numba uses. It is to call compiled code that releases
    the interpreter and is not threaded itself, and must not depend on the order of its calls. Few
    results wait to be taken, so that memory holds no more of them.

    Examples
    --------
    >>> list(in_threads(lambda number: number**2, [1, 2, 3]))
    [1, 4, 9]
    """
    threads = get_num_threads()
    waiting: deque[Future[S]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(work, item))
                if len(waiting) > AHEAD * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for result in waiting:
                result.cancel()


def in_ranges(
    kernel: Callable[..., object], numbers: range, *arguments: Any, threaded: bool = True
) -> None:
    """Call a compiled kernel for parts of a range, one in each of numba's threads.

    Parameters
    ----------
    kernel : callable
        ``kernel(low, high, *arguments)``, compiled to release the interpreter; what it writes for
        one number is to depend on no other.
    numbers : range
        Cut at multiples of its step: as many numbers as are worth a thread.
    *arguments
        Of the kernel, after the range.
    threaded : bool
        False: one call, in this thread.

    Examples
    --------
    >>> import numpy as np
    >>> def fill(low, high, values):
    ...     values[low:high] = np.arange(low, high)
    >>> values = np.zeros(6)
    >>> in_ranges(fill, range(0, 6, 2), values)
    >>> values
    array([0., 1., 2., 3., 4., 5.])
    """
    count, end = len(numbers), numbers.stop
    if count == 0:
        return
    pieces = min(get_num_threads(), count) if threaded else 1
    if pieces < 2:
        kernel(numbers.start, end, *arguments)
        return
    ends = [numbers.start + numbers.step * (count * k // pieces) for k in range(pieces)]
    pool = _pool(os.getpid())
    others = [
        pool.submit(kernel, low, high, *arguments)
        for low, high in zip(ends[1:], [*ends[2:], end], strict=True)
    ]
    try:
        kernel(ends[0], ends[1], *arguments)
    finally:
        # Nothing may write to the arguments any more once this returns.
        errors = [other.exception() for other in others]
    for error in errors:
        if error is not None:
            raise error


@lru_cache(maxsize=1)
def _pool(process: int) -> ThreadPoolExecutor:  # noqa: ARG001
    """Threads that wait for ranges; a forked process has none of its parent's."""
    return ThreadPoolExecutor(max(1, config.NUMBA_NUM_THREADS - 1))
