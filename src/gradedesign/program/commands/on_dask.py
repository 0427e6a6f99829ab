"""Independent computations spread over dask: processes of this machine, or a running cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from numba import get_num_threads, set_num_threads

from gradedesign.common.system.progress import counted
from gradedesign.errors import CaseError


@dataclass(frozen=True, slots=True, kw_only=True)
class Cluster:
    """Workers that independent computations are sent to."""

    workers: int  #: Processes on this machine.
    scheduler: str | None = None  #: Address of a running dask cluster, used instead.
    threads: int | None = 1  #: Of each computation; None for those that its worker has.


def has_dask() -> bool:
    """Whether dask is installed."""
    return find_spec("distributed") is not None


def on_dask(
    function: Callable[..., Any],
    tasks: Sequence[tuple[Any, ...]],
    cluster: Cluster,
    *,
    text: str,
) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Call a function with each tuple of arguments, and hand on the ends as they come.

    ``function``: at the top of a module, which the workers import: plugins must be installed there.
    ``tasks``: arguments, plain data. ``text``: name of the computation, for the lines of progress.
    Raises `CaseError` if dask is not installed, or no cluster answers at the address. Yields
    futures that have ended: ``result()`` returns or raises what the function did.
    """
    if not has_dask():
        raise CaseError(
            "computing in several processes needs dask: pip install distributed; or take --workers "
            "1"
        )
    # Not by an import statement: it is optional, and type checks must pass without it too.
    distributed = import_module("distributed")
    logging.getLogger("distributed").setLevel(logging.WARNING)
    with ExitStack() as stack:
        address: Any = cluster.scheduler
        if address is None:
            # What memory a computation may take is its own to keep: dask would kill it half-way.
            address = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=cluster.workers,
                    threads_per_worker=1,
                    dashboard_address=None,
                    memory_limit=None,
                )
            )
        try:
            client = stack.enter_context(distributed.Client(address, timeout="20s"))
        except OSError as error:
            raise CaseError(
                f"no dask cluster answers at {cluster.scheduler}: {error}; start one, or leave "
                f"--scheduler out"
            ) from error
        futures = {
            client.submit(with_threads, cluster.threads, function, *task, pure=False): task
            for task in tasks
        }
        ended = distributed.as_completed(list(futures))
        for future in counted(ended, f"{text}, number", len(tasks)):
            yield futures[future], future


def with_threads(threads: int | None, function: Callable[..., Any], *task: Any) -> Any:
    """Call a function on a number of threads.

    Not by an environment variable: numba reads those again whenever it compiles, and refuses one
    that has changed.
    """
    before = get_num_threads()
    set_num_threads(before if threads is None else min(threads, before))
    try:
        return function(*task)
    finally:
        set_num_threads(before)
