"""Independent pieces of work in the threads of the compiled kernels."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from numba import get_num_threads

#: Items for every thread that are begun before the first result is taken. Chosen, not measured.
AHEAD = 2

T = TypeVar("T")
S = TypeVar("S")


def in_threads(work: Callable[[T], S], items: Iterable[T]) -> Iterator[S]:
    """Results of a function of each item, in the order of the items.

    The function runs in as many threads as numba uses. It is to call compiled code that releases
    the interpreter and is not threaded itself, and must not depend on the order of its calls. Few
    results wait to be taken, so that memory holds no more of them.
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
