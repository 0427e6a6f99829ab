"""The reason why a worker process ended, as the error that its caller gets."""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass
from pathlib import Path

from gradedesign.errors import GradeDesignError, MeshError, ResourceError

#: How a worker says that it ran out of memory: the exit code of `ResourceError`.
MEMORY_EXIT = ResourceError.exit_code
#: Files in a worker's folder: what it printed, that it began its work, the most memory it held.
LOG_NAME, READY_NAME, _PEAK_NAME = "log.txt", "ready", "peak.txt"
#: Exit code after SIGKILL, a name that Windows lacks.
_KILLED = -9
#: A worker that held this share of its limit when it was killed had no memory left. Chosen, not
#: measured.
_NEAR_LIMIT = 0.8
#: Messages of libraries that cannot get address space, for arrays, stacks or their own code.
_OUT_OF_MEMORY = (
    "MemoryError",
    "bad_alloc",
    "Cannot allocate memory",
    "failed to map segment",
    "pthread_create has failed",
    "pthread_create failed",
    "Memory allocation still failed",  # OpenBLAS, as numpy is imported
    "RuntimeError: Resource temporarily unavailable",  # a thread of the mesher
)
#: The end of what a worker said, a screen of it. Chosen, not measured.
_LAST_BYTES = 4096
#: Lines that a message quotes: the error and what led to it. Chosen, not measured.
_LAST_LINES = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """The way in which a worker ended."""

    module: str  #: Its name.
    folder: Path  #: Where it ran.
    code: int | None  #: Exit code, minus the signal that ended it, or None at the time limit.
    time_limit_s: float
    memory_limit_bytes: int  #: Of its address space.


def runs_out_of_memory(ending: Ending) -> bool:
    """Tell whether a worker said that it got no more memory."""
    if ending.code is None or ending.code == _KILLED:
        return False
    words = last_words(ending.folder)
    return ending.code == MEMORY_EXIT or any(sign in words for sign in _OUT_OF_MEMORY)


def worker_error(ending: Ending, bytes_to_start: int | None) -> GradeDesignError:
    """Say why a worker ended as it did.

    ``bytes_to_start``: address space it takes before it begins to work, where it did not get as far
    and that is known. Returns GradeDesignError: `ResourceError` for memory and for a kill from
    outside, else `MeshError`.
    """
    module, code, words = ending.module, ending.code, last_words(ending.folder)
    limit = _size(ending.memory_limit_bytes)
    if code is None:
        return MeshError(f"worker {module} timed out after {ending.time_limit_s:.4g} s; {words}")
    if bytes_to_start is not None and bytes_to_start > 0.9 * ending.memory_limit_bytes:
        return ResourceError(
            f"the process of worker {module} needs about {_size(bytes_to_start)} of address space "
            f"before it begins its work; found a limit of {limit}; raise run.memory to at least "
            f"{_size(2 * bytes_to_start)}"
        )
    if code == _KILLED:
        return _killed(ending, words)
    if runs_out_of_memory(ending):
        return ResourceError(
            f"worker {module} needs more memory than its limit of {limit}, or than the machine "
            f"has left; raise run.memory or ask for a coarser mesh; {words}"
        )
    if code < 0:
        return MeshError(f"worker {module} crashed with {_signal_name(-code)}; {words}")
    return MeshError(f"worker {module} failed with exit code {code}; {words}")


def _killed(ending: Ending, words: str) -> ResourceError:
    """Say who may have sent a SIGKILL; we only send it ourselves after the end."""
    peak = _peak_bytes(ending.folder)
    limit = _size(ending.memory_limit_bytes)
    memory = "an unknown amount of memory" if peak is None else f"{_size(peak)} of memory"
    if peak is not None and peak >= _NEAR_LIMIT * ending.memory_limit_bytes:
        return ResourceError(
            f"worker {ending.module} was killed while it held {memory}, near its limit of {limit}; "
            f"raise run.memory or ask for a coarser mesh; {words}"
        )
    return ResourceError(
        f"worker {ending.module} was killed from outside (SIGKILL) while it held {memory} of the "
        f"{limit} it may take: by a person or a batch system, or by the memory guard of the "
        f"system or the container, if that has less left than run.memory says; resume the "
        f"run, on a machine with more memory or with a coarser mesh if it happens again; "
        f"{words}"
    )


def _peak_bytes(folder: Path) -> int | None:
    """Return the most memory a worker held, as its launcher noted it."""
    try:
        return int((folder / _PEAK_NAME).read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None  # the launcher itself was killed


def _size(count: float) -> str:
    """Return bytes as the case file writes them."""
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.3g} MB"


def _signal_name(number: int) -> str:
    """Return SIGSEGV and the like, or the number of a signal without a name."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def last_words(folder: Path) -> str:
    """Quote the last lines that a worker printed."""
    with (folder / LOG_NAME).open("rb") as handle:
        length = handle.seek(0, os.SEEK_END)
        handle.seek(max(0, length - _LAST_BYTES))
        text = handle.read().decode("utf-8", "replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()][-_LAST_LINES:]
    return "last output: " + " | ".join(lines) if lines else "it printed nothing"
