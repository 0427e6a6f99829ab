"""Independent pieces of work in the threads of the compiled kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from numba import get_num_threads

T = TypeVar("T")
S = TypeVar("S")


def in_threads(work: Callable[[T], S], items: Iterable[T]) -> Iterator[S]:
    """Results of a function of each item, in the order of the items.

    The function runs in as many threads as numba uses. It is to call compiled code that releases
    the interpreter and is not threaded itself, and must not depend on the order of its calls.
    """
    with ThreadPoolExecutor(get_num_threads()) as pool:
        results = [pool.submit(work, item) for item in items]
        try:
            for result in results:
                yield result.result()
        finally:
            for result in results:
                result.cancel()
